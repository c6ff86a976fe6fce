// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/world/world.hpp"
#include "core/reach/bound/block_extents.hpp"
#include "core/reach/clearance.hpp"
#include "core/reach/hover_set.hpp"
#include "tests/support/rounded_up.hpp"

namespace backwash::reach {
namespace {

Vehicle test_vehicle() {
  Vehicle vehicle;
  vehicle.body = {.radius = 0.16, .diagonal_radius = 0.18, .rotor_radius = 0.06, .mass = 0.8};
  vehicle.controller = {.kp = {6.0, 8.0}, .kd = {4.0, 5.0}, .latency = 0, .feedback_delay = 0, .attitude_lag = 0};
  vehicle.estimation.position = 0.02;
  return vehicle;
}

/// A room of 2.4 × 2.4 × 1.6 m: floor, one wall (y = 0), a pillar; the other sides end in the unknown.
map::OccupancyGrid room() {
  const Index3 size(24, 24, 16);
  map::OccupancyGrid grid(Vec3::Zero(), 0.1, size, map::Cell::free);
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const Index3 v = grid.voxel(n);
    const bool pillar = (v.head<2>().array() - 16).abs().maxCoeff() <= 1;
    if (v.z() == 0 || v.y() == 0 || pillar) grid.set(v, map::Cell::occupied);
  }
  return grid;
}

Model with_kappa(double kappa) {
  Model model;
  model.bound.kappa = kappa;
  return model;
}

struct HoverScene {
  map::OccupancyGrid grid;
  map::DistanceField distance;
  field::DisturbanceField field;
  Model model;
  BoundField bounds;
};

/// The field is stored in every free voxel, so that only the model decides what is near an obstacle.
HoverScene make_scene(const Model& model) {
  map::OccupancyGrid grid = room();
  std::vector<std::size_t> voxels;
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    if (grid.at(n) == map::Cell::free) voxels.push_back(n);
  }
  field::DisturbanceField field(grid, voxels);
  field.fill(field::ProximityField(grid, model), voxels);
  map::DistanceField distance(grid);
  BoundField bounds(grid, field, model.bound);
  return {std::move(grid), std::move(distance), std::move(field), model, std::move(bounds)};
}

std::vector<Vec3> random_points(const map::OccupancyGrid& grid, std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  std::vector<Vec3> points;
  while (points.size() < count) {
    const Vec3 p = grid.origin() +
                   grid.resolution() * grid.size().cast<double>().cwiseProduct(Vec3(u(random), u(random), u(random)));
    if (grid.free(grid.index(p))) points.push_back(p);
  }
  return points;
}

double h_inf(const Reachability& reach, std::size_t d) {
  return d == kZ ? reach.vertical.h_inf : reach.horizontal.h_inf;
}

/// F(h) = h_∞ × max w̄ over the voxels that meet p ± h, by a loop over the whole grid.
PerDirection image(const HoverScene& scene, const Reachability& reach, const Vec3& p, const PerDirection& h) {
  PerDirection result{};
  const Vec3 reach_of_box = Vec3(h[kX], h[kY], h[kZ]) + Vec3::Constant(scene.grid.resolution() / 2);
  for (std::size_t n = 0; n < scene.grid.cell_count(); ++n) {
    const Index3 v = scene.grid.voxel(n);
    if (!scene.field.has(v) || ((scene.grid.center(v) - p).cwiseAbs().array() > reach_of_box.array()).any()) continue;
    const DisturbanceBound w = bound(scene.field.at(v), scene.model.bound);
    for (std::size_t d = 0; d < kDirections; ++d) result[d] = std::max(result[d], h_inf(reach, d) * rounded_up(w.w[d]));
  }
  return result;
}

/// The scene used by most claims; built once.
const HoverScene& default_scene() {
  static const HoverScene scene = make_scene(with_kappa(3));
  return scene;
}

TEST(HoverSet, IsAFixedPointOfTheWorstBoundOverItself) {
  const HoverScene& scene = default_scene();
  const Reachability reach(test_vehicle(), Method::tight, Loop::continuous);
  int grown = 0, bounded = 0;
  for (const Vec3& p : random_points(scene.grid, 300, 1)) {
    const HoverSet set = hover_set(reach, scene.grid, scene.distance, scene.bounds, p);
    if (!set.bounded) continue;
    ++bounded;
    const PerDirection expected = image(scene, reach, p, set.half_widths);
    for (std::size_t d = 0; d < kDirections; ++d) EXPECT_NEAR(set.half_widths[d], expected[d], 1e-6 * expected[d]);
    const DisturbanceBound at_center = scene.bounds.at(scene.grid.index(p));
    grown += set.half_widths[kY] > 1.001 * h_inf(reach, kY) * at_center.w[kY];
  }
  EXPECT_GT(bounded, 100);
  EXPECT_GT(grown, 50);  // elsewhere the set lies within one voxel and the claim is empty
}

// Tarski: the smallest fixed point lies below every h with F(h) ≤ h, so no such h lies below it.
TEST(HoverSet, IsTheSmallestFixedPoint) {
  const HoverScene& scene = default_scene();
  const Reachability reach(test_vehicle(), Method::tight, Loop::continuous);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> shrink(0.3, 0.999);
  for (const Vec3& p : random_points(scene.grid, 100, 3)) {
    const HoverSet set = hover_set(reach, scene.grid, scene.distance, scene.bounds, p);
    if (!set.bounded) continue;
    for (int trial = 0; trial < 10; ++trial) {
      PerDirection smaller = set.half_widths;
      for (double& h : smaller) h *= shrink(random);
      const PerDirection F = image(scene, reach, p, smaller);
      bool contained = true;
      for (std::size_t d = 0; d < kDirections; ++d) contained = contained && F[d] <= smaller[d];
      EXPECT_FALSE(contained);
    }
  }
}

TEST(HoverSet, GrowsWithTheDisturbance) {
  const HoverScene& weak = default_scene();
  const HoverScene strong = make_scene(with_kappa(4));
  const Reachability reach(test_vehicle(), Method::tight, Loop::continuous);
  for (const Vec3& p : random_points(weak.grid, 300, 4)) {
    const HoverSet small = hover_set(reach, weak.grid, weak.distance, weak.bounds, p);
    const HoverSet large = hover_set(reach, strong.grid, strong.distance, strong.bounds, p);
    EXPECT_TRUE(small.bounded || !large.bounded);
    if (!large.bounded) continue;
    EXPECT_LE(large.clearance, small.clearance);
    for (std::size_t d = 0; d < kDirections; ++d) EXPECT_GT(large.half_widths[d], small.half_widths[d]);
  }
}

TEST(HoverSet, IsUnboundedWhereTheFieldIsTooStrong) {
  const HoverScene scene = make_scene(with_kappa(200));
  const Reachability reach(test_vehicle(), Method::tight, Loop::continuous);
  const HoverSet at_wall = hover_set(reach, scene.grid, scene.distance, scene.bounds, Vec3(0.8, 0.35, 0.6));
  EXPECT_FALSE(at_wall.bounded);
  EXPECT_FALSE(at_wall.safe());
  EXPECT_LT(at_wall.clearance, 0);
}

TEST(HoverSet, ClearanceIsTheDistanceOfThePrismLessBodyAndEstimation) {
  const HoverScene& scene = default_scene();
  const Reachability reach(test_vehicle(), Method::tight, Loop::continuous);
  int positive = 0;
  for (const Vec3& p : random_points(scene.grid, 300, 5)) {
    const HoverSet set = hover_set(reach, scene.grid, scene.distance, scene.bounds, p);
    if (!set.bounded) continue;
    const double expected = std::min(1.0, prism_distance(scene.grid, p, set.half_widths, 1e3) - 0.16 - 0.02);
    EXPECT_NEAR(set.clearance, expected, 1e-9);
    EXPECT_EQ(set.safe(), expected > 0);
    positive += expected > 0;
  }
  EXPECT_GT(positive, 30);
}

// Without a disturbance the set is a point; with the base variance alone it is small and the same everywhere.
TEST(HoverSet, ClearanceInTheOpenIsExactUpToItsCapOfOneMetre) {
  const map::OccupancyGrid grid(Vec3::Zero(), 0.2, Index3(20, 20, 20), map::Cell::free);
  const map::DistanceField distance(grid);
  const Reachability reach(test_vehicle(), Method::tight, Loop::continuous);
  std::vector<std::size_t> voxels(grid.cell_count());
  std::iota(voxels.begin(), voxels.end(), 0u);
  field::DisturbanceField field(grid, voxels);
  field.fill(field::ProximityField(grid, Model{}), voxels);
  int capped = 0, near_cap = 0;
  for (const double kappa : {0.0, 3.0}) {
    const BoundField bounds(grid, field, BoundModel{kappa, 0, 0, 0.15});
    for (const Vec3& p : random_points(grid, 1000, 8)) {
      const HoverSet set = hover_set(reach, grid, distance, bounds, p);
      const Vec3 h(set.half_widths[kX], set.half_widths[kY], set.half_widths[kZ]);
      const double to_sides = (p.cwiseMin(Vec3::Constant(4) - p) - h).minCoeff();
      EXPECT_NEAR(set.clearance, std::min(1.0, std::max(0.0, to_sides) - 0.16 - 0.02), 1e-9);
      capped += to_sides > 1.18;
      near_cap += to_sides > 1.0 && to_sides < 1.18;
    }
  }
  EXPECT_GT(capped, 50);
  EXPECT_GT(near_cap, 50);
}

TEST(HoverSet, IsNeverSafeOutsideFreeSpace) {
  const HoverScene& scene = default_scene();
  const Reachability reach(test_vehicle(), Method::tight, Loop::continuous);
  for (const Vec3& p : {Vec3(-1, 1, 1), Vec3(1, 1, 1.7), Vec3(1, 1, 0.05), Vec3(1, 0.05, 1)}) {
    for (const auto margin : {std::optional<double>(), std::optional(0.0)}) {
      const HoverSet set = hover_set(reach, scene.grid, scene.distance, scene.bounds, p, margin);
      EXPECT_FALSE(set.safe());
      EXPECT_LT(set.clearance, 0);
    }
  }
}

TEST(HoverSet, ConstantMarginReplacesTheExtentAndNothingElse) {
  const HoverScene& scene = default_scene();
  const Reachability reach(test_vehicle(), Method::tight, Loop::continuous);
  for (const Vec3& p : random_points(scene.grid, 200, 6)) {
    double nearest = p.cwiseMin(Vec3(2.4, 2.4, 1.6) - p).minCoeff();
    for (std::size_t n = 0; n < scene.grid.cell_count(); ++n) {
      if (scene.grid.at(n) == map::Cell::free) continue;
      const Vec3 gap = (p - scene.grid.center(scene.grid.voxel(n))).cwiseAbs() - Vec3::Constant(0.05);
      nearest = std::min(nearest, gap.cwiseMax(0.0).norm());
    }
    const HoverSet set = hover_set(reach, scene.grid, scene.distance, scene.bounds, p, 0.1);
    EXPECT_NEAR(set.clearance, nearest - 0.1 - 0.16 - 0.02, 1e-9);
  }
}

/// The bounds of a scene where the same mean push acts everywhere.
BoundField pushed(const HoverScene& scene, const Vec3& push_W) {
  Model model = scene.model;
  model.extension = {{Law::push, push_W, Vec3::Zero(), 0}};
  return {scene.grid, scene.field, model.bound, field::Extension(scene.grid, model)};
}

TEST(HoverSet, OfAPushedVehicleIsJudgedWhereThePushHoldsIt) {
  const HoverScene& scene = default_scene();
  const Reachability reach(test_vehicle(), Method::tight, Loop::continuous);
  const Vec3 push(0, -1.2, 0.8), shift = push.cwiseQuotient(Vec3(6, 6, 8));
  const BoundField bounds = pushed(scene, push);
  int into_obstacles = 0, judged = 0;
  for (const Vec3& p : random_points(scene.grid, 500, 9)) {
    const HoverSet set = hover_set(reach, scene.grid, scene.distance, bounds, p);
    const Vec3 c = p + shift;
    if (!scene.grid.free(scene.grid.index(c))) {
      EXPECT_FALSE(set.bounded) << p.transpose();
      ++into_obstacles;
    } else if (set.bounded) {
      EXPECT_NEAR(set.clearance, std::min(1.0, prism_distance(scene.grid, c, set.half_widths, 1e3) - 0.16 - 0.02),
                  1e-9);
      ++judged;
    }
  }
  EXPECT_GT(into_obstacles, 30);
  EXPECT_GT(judged, 100);
}

TEST(HoverSet, IsNotSafeInAnObstacleThatThePushWouldTakeTheVehicleOutOf) {
  const HoverScene& scene = default_scene();
  const Reachability reach(test_vehicle(), Method::tight, Loop::continuous);
  const BoundField bounds = pushed(scene, Vec3(0, 6 * 0.9, 0));
  const Vec3 in_wall(0.85, 0.05, 0.75);
  ASSERT_TRUE(hover_set(reach, scene.grid, scene.distance, scene.bounds, in_wall + Vec3(0, 0.9, 0)).safe());
  EXPECT_FALSE(hover_set(reach, scene.grid, scene.distance, bounds, in_wall).bounded);
  EXPECT_FALSE(hover_set(reach, scene.grid, scene.distance, bounds, in_wall, 0.05).bounded);
}

TEST(HoverSet, OfThePaperContainsTheTightOneAlongTheAxes) {
  const HoverScene scene = make_scene(with_kappa(1.5));  // the paper's larger sets must fit as well
  const Reachability tight(test_vehicle(), Method::tight, Loop::continuous);
  const Reachability paper(test_vehicle(), Method::paper, Loop::continuous);
  int compared = 0;
  for (const Vec3& p : random_points(scene.grid, 200, 7)) {
    const HoverSet inner = hover_set(tight, scene.grid, scene.distance, scene.bounds, p);
    const HoverSet outer = hover_set(paper, scene.grid, scene.distance, scene.bounds, p);
    EXPECT_TRUE(inner.bounded || !outer.bounded);
    if (!outer.bounded) continue;
    for (const Direction d : {kX, kY, kZ}) EXPECT_GE(outer.half_widths[d], inner.half_widths[d]);
    ++compared;
  }
  EXPECT_GT(compared, 50);
}

// The hover map decides by brackets; hover_set computes each set's exact clearance. Both must say the same.

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
