// SPDX-License-Identifier: BSD-3-Clause
// The hover map decides by brackets; hover_set computes each set's exact clearance. Both must say the same.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/world/world.hpp"
#include "core/reach/bound/block_extents.hpp"

namespace backwash::reach {
namespace {

struct Count {
  int safe = 0, unsafe = 0;
};

/// Every `stride`-th voxel of `w`, filled and asked one by one. Nearer than `band` to touching nothing is claimed: the
/// paper's sets come from a table there.
Count expect_agreement(const plan::World& w, const Reachability& reach, std::size_t stride, double band) {
  std::vector<std::size_t> listed;
  for (std::size_t n = 0; n < w.grid.cell_count(); n += stride) listed.push_back(n);
  HoverMap hover(w.grid);
  hover.fill(reach, w.grid, w.distance, w.sums, w.bounds, listed);
  Count count;
  int disagree = 0;
  for (const std::size_t n : listed) {
    const Index3 v = w.grid.voxel(n);
    if (!w.grid.free(v)) {
      disagree += hover.safe(v);
      continue;
    }
    const HoverSet set = hover_set(reach, w.grid, w.distance, w.bounds, w.grid.center(v));
    if (std::abs(set.clearance) < band) continue;
    disagree += hover.safe(v) != set.safe();
    set.safe() ? ++count.safe : ++count.unsafe;
  }
  EXPECT_EQ(disagree, 0);
  return count;
}

Vehicle with_unequal_gains() {
  Vehicle vehicle;
  vehicle.body = {.radius = 0.16, .diagonal_radius = 0.18, .rotor_radius = 0.06, .mass = 0.8};
  vehicle.controller = {.kp = {6.0, 12.0}, .kd = {4.0, 5.0}, .latency = 0, .feedback_delay = 0, .attitude_lag = 0};
  vehicle.estimation.position = 0.02;
  return vehicle;
}

/// Boxes at random places, of occupied or unknown voxels, in a free room.
map::OccupancyGrid random_room(unsigned seed) {
  std::mt19937 random(seed);
  map::OccupancyGrid grid(Vec3(-1, 2, 0), 0.1, Index3(30, 26, 20), map::Cell::free);
  const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  for (int box = 0; box < 12; ++box) {
    const Index3 low(below(30), below(26), below(20)), size(1 + below(3), 1 + below(3), 1 + below(8));
    const auto cell = box % 3 == 0 ? map::Cell::unknown : map::Cell::occupied;
    for (int k = 0; k < size.z(); ++k)
      for (int j = 0; j < size.y(); ++j)
        for (int i = 0; i < size.x(); ++i)
          if (const Index3 v = low + Index3(i, j, k); grid.inside(v)) grid.set(v, cell);
  }
  return grid;
}

TEST(BlockExtents, NoSetOfAVoxelReachesFartherAndFewReachMuchLess) {
  Vehicle vehicle = config::load_vehicle("builtin:quad-5in").value();
  for (const double gain : {1.0, 0.2}) {  // of wide sets, which reach over several blocks
    vehicle.controller.kp.horizontal *= gain;
    for (unsigned seed = 1; seed <= 3; ++seed) {
      const auto w = plan::build_world(random_room(seed), Model{}, vehicle);
      BlockExtents extents(w->reach, w->bounds, w->grid.size(), w->grid.resolution());
      int bounded = 0, tight = 0;
      for (std::size_t n = 0; n < w->grid.cell_count(); ++n) {
        const Index3 v = w->grid.voxel(n);
        if (!w->grid.free(v)) continue;
        const HoverSet set = hover_extent(w->reach, w->grid, w->distance, w->bounds, w->grid.center(v));
        if (!set.bounded) continue;
        const Vec3 own(set.half_widths[kX], set.half_widths[kY], set.half_widths[kZ]), most = extents.at(v);
        ASSERT_TRUE((own.array() <= most.array()).all()) << v.transpose();
        ++bounded;
        tight += (most.array() <= 1.5 * own.array()).all();
      }
      EXPECT_GT(bounded, 500);
      EXPECT_GT(tight, bounded / 3);
    }
  }
}

TEST(HoverMap, SaysOfEveryVoxelOfRandomRoomsWhatTheExactSetSays) {
  Model model;
  model.bound.kappa = 1.5;  // the paper's larger sets must fit as well
  Count tight, paper;
  for (unsigned seed = 0; seed < 8; ++seed) {
    const auto w = plan::build_world(random_room(seed), model, with_unequal_gains());
    const Count t = expect_agreement(*w, w->reach, 1, 1e-9);
    const Count p = expect_agreement(*w, Reachability(with_unequal_gains(), Method::paper, Loop::continuous), 1, 1e-4);
    tight.safe += t.safe;
    tight.unsafe += t.unsafe;
    paper.safe += p.safe;
    paper.unsafe += p.unsafe;
  }
  for (const Count& count : {tight, paper}) {
    EXPECT_GT(count.safe, 1000);
    EXPECT_GT(count.unsafe, 1000);
  }
}

TEST(HoverMap, OfAConstantMarginSaysWhatTheSetSays) {
  Count count;
  for (unsigned seed = 0; seed < 3; ++seed) {
    const auto w = plan::build_world(random_room(seed), Model{}, with_unequal_gains(), Method::tight, 0.15);
    for (std::size_t n = 0; n < w->grid.cell_count(); ++n) {
      const Index3 v = w->grid.voxel(n);
      if (!w->grid.free(v)) continue;
      const HoverSet set = hover_set(w->reach, w->grid, w->distance, w->bounds, w->grid.center(v), 0.15);
      if (std::abs(set.clearance) < 1e-5) continue;  // stored distances are single precision
      EXPECT_EQ(w->hover.safe(v), set.safe());
      set.safe() ? ++count.safe : ++count.unsafe;
    }
  }
  EXPECT_GT(count.safe, 1000);
  EXPECT_GT(count.unsafe, 1000);
}

void expect_agreement_on(const map::OccupancyGrid& grid, std::size_t stride) {
  const Vehicle vehicle = *config::load_vehicle("builtin:quad-5in");
  const auto w = plan::build_world(grid, *config::load_model("builtin:quad-5in"), vehicle);
  EXPECT_GT(expect_agreement(*w, w->reach, stride, 1e-9).safe, 1000);
  EXPECT_GT(expect_agreement(*w, Reachability(vehicle, Method::paper, Loop::continuous), 4 * stride, 1e-4).safe, 1000);
}

TEST(HoverMap, SaysInTheApartmentWhatTheExactSetSays) {
  const auto grid = map::load_map("builtin:apartment");
  ASSERT_TRUE(grid);
  expect_agreement_on(*grid, 3);
}

TEST(HoverMap, SaysInARealBuildingWhatTheExactSetSays) {
  const std::string path = BACKWASH_SOURCE_DIR "/tests/data/maps/geb079.bt";
  const auto grid = map::load_map(path);
  ASSERT_TRUE(grid);
  expect_agreement_on(*grid, 5);
}

TEST(HoverMap, HoldsTheListedVoxelsAndNothingElse) {
  const auto w = plan::build_world(random_room(1), Model{}, with_unequal_gains());
  std::vector<std::size_t> listed;
  for (std::size_t n = 0; n < w->grid.cell_count(); n += 2) listed.push_back(n);
  HoverMap hover(w->grid);
  hover.fill(w->reach, w->grid, w->distance, w->sums, w->bounds, listed);
  int safe = 0;
  for (std::size_t n = 0; n < w->grid.cell_count(); ++n) {
    const Index3 v = w->grid.voxel(n);
    EXPECT_EQ(hover.safe(v), n % 2 == 0 && w->hover.safe(v));
    safe += hover.safe(v);
  }
  EXPECT_GT(safe, 100);
  EXPECT_FALSE(hover.safe(Index3(-1, 3, 3)));
  EXPECT_FALSE(hover.safe(Index3(3, 26, 3)));
}

}  // namespace
}  // namespace backwash::reach
