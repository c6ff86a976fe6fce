// SPDX-License-Identifier: BSD-3-Clause
// Bounds are stored in 16 bits. No set may shrink by that: what is read is held against the field's own values in
// double precision.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/planner.hpp"
#include "core/plan/world/world.hpp"
#include "tests/support/rounded_up.hpp"
#include "tests/support/stored_field.hpp"

namespace backwash::reach {
namespace {

/// Largest bound of the voxels from low to high, by its definition.
PerDirection largest(const field::DisturbanceField& field, const BoundModel& model, const Index3& low,
                     const Index3& high) {
  PerDirection maximum{};
  for (int k = low.z(); k <= high.z(); ++k)
    for (int j = low.y(); j <= high.y(); ++j)
      for (int i = low.x(); i <= high.x(); ++i) {
        if (!field.has({i, j, k})) continue;
        const DisturbanceBound w = bound(field.at({i, j, k}), model);
        for (std::size_t d = 0; d < kDirections; ++d) maximum[d] = std::max(maximum[d], w.w[d]);
      }
  return maximum;
}

/// Random boxes of up to `most` voxels an edge; the number of them that held a bound.
int expect_rounded_up(const plan::World& world, const Model& model, int boxes, int most, unsigned seed) {
  std::mt19937 random(seed);
  const field::DisturbanceField field = test::stored_field(world, model);
  int held = 0;
  for (int trial = 0; trial < boxes; ++trial) {
    Index3 low, high;
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::uniform_int_distribution<int>(0, world.grid.size()[axis] - 1)(random);
      high[axis] =
          std::min(low[axis] + std::uniform_int_distribution<int>(0, most - 1)(random), world.grid.size()[axis] - 1);
    }
    const bool one = trial % 4 == 0;
    if (one) high = low;
    const PerDirection w = largest(field, model.bound, low, high);
    const PerDirection read = one ? world.bounds.at(low).w : world.bounds.max_over_voxels(low, high).w;
    for (std::size_t d = 0; d < kDirections; ++d) {
      EXPECT_GE(read[d], w[d]);
      EXPECT_GE(static_cast<float>(read[d]), static_cast<float>(w[d]));
      EXPECT_LE(read[d], w[d] * (1 + std::ldexp(1.0, -11)));
    }
    held += w[kZ] > 0;
  }
  return held;
}

TEST(BoundCode, NoBoundReadFromARandomMapIsBelowTheFieldsOrATwoThousandthAboveIt) {
  Model model = *config::load_model("builtin:quad-5in");
  const Vehicle vehicle = *config::load_vehicle("builtin:quad-5in");
  model.bound = {2.7, 0.13, 0.21, 0.15};
  for (unsigned seed = 0; seed < 6; ++seed) {
    std::mt19937 random(seed);
    map::OccupancyGrid grid(Vec3(-1, 2, 0), 0.1, Index3(33, 26, 20), map::Cell::free);
    const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    for (int box = 0; box < 8; ++box) {
      const Index3 low(below(33), below(26), below(20)), extent(1 + below(6), 1 + below(6), 1 + below(9));
      const Index3 high = (low + extent).cwiseMin(grid.size());
      for (int k = low.z(); k < high.z(); ++k)
        for (int j = low.y(); j < high.y(); ++j)
          for (int i = low.x(); i < high.x(); ++i) grid.set({i, j, k}, map::Cell::occupied);
    }
    const auto world = plan::build_world(std::move(grid), model, vehicle);
    EXPECT_GT(expect_rounded_up(*world, model, 1000, 9, seed), 200);
  }
}

TEST(BoundCode, NoneOfABuildingIsEither) {
  const std::string file = BACKWASH_SOURCE_DIR "/tests/data/maps/geb079.bt";
  const Model model = *config::load_model("builtin:quad-5in");
  const auto world = plan::build_world(*map::load_map(file), model, *config::load_vehicle("builtin:quad-5in"));
  EXPECT_GT(expect_rounded_up(*world, model, 20000, 12, 1), 2000);
}

TEST(BoundCode, IsTheLeastOfTwelveSignificantBitsThatIsNotBelow) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> exponent(-15, 15.999);
  for (int trial = 0; trial < 100000; ++trial) {
    const double w = std::exp2(exponent(random));
    ASSERT_EQ(bound_of(code_of(w)), rounded_up(w)) << w;
  }
}

TEST(BoundCode, OfABoundThatACodeHasIsThatBoundAndTheOrderIsTheBounds) {
  double before = -1;
  for (unsigned code = 0; code < kUnbounded; ++code) {
    if (code > 0 && code < 2048) continue;  // below the least
    const double w = bound_of(static_cast<BoundCode>(code));
    ASSERT_GT(w, before);
    ASSERT_EQ(code_of(w), code);
    before = w;
    if (code == 0) continue;
    ASSERT_GT(code_of(std::nextafter(w, 1e300)), code);
    ASSERT_EQ(code_of(std::nextafter(w, 0)), code);
  }
}

TEST(BoundCode, ZeroStaysZeroAndWhatIsOutsideTheRangeGoesUp) {
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_EQ(bound_of(code_of(0)), 0);
  EXPECT_EQ(bound_of(code_of(std::numeric_limits<double>::denorm_min())), std::ldexp(1.0, -15));
  EXPECT_EQ(bound_of(code_of(std::ldexp(0.9, -15))), std::ldexp(1.0, -15));
  EXPECT_EQ(bound_of(code_of(std::ldexp(4094.0, 4))), std::ldexp(4094.0, 4));
  EXPECT_EQ(bound_of(code_of(std::ldexp(4094.5, 4))), infinite);
  EXPECT_EQ(bound_of(code_of(1e40)), infinite);
  EXPECT_EQ(bound_of(code_of(infinite)), infinite);
  EXPECT_EQ(bound_of(code_of(std::nan(""))), infinite);
}

TEST(BoundCode, AnInfiniteBoundLeavesNoPlaceToHover) {
  map::OccupancyGrid grid(Vec3::Zero(), 0.1, Index3(20, 20, 20), map::Cell::free);
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 20; ++j) grid.set({i, j, 0}, map::Cell::occupied);
  Model model = *config::load_model("builtin:quad-5in");
  model.bound.kappa = 1e12;
  for (const Method method : {Method::tight, Method::paper}) {
    const auto world = plan::build_world(grid, model, *config::load_vehicle("builtin:quad-5in"), method);
    EXPECT_EQ(world->bounds.at({10, 10, 10}).w[kX], std::numeric_limits<double>::infinity());
    EXPECT_FALSE(world->hover.safe({10, 10, 10}));
    EXPECT_FALSE(hover_extent(world->reach, world->grid, world->distance, world->bounds, Vec3::Constant(1.05)).bounded);
    EXPECT_FALSE(hover_set(world->reach, world->grid, world->distance, world->bounds, Vec3::Constant(1.05)).safe());
    const State there{Vec3::Constant(1.05)};
    const std::vector<Setpoint> held(10, Setpoint{there.p_W});
    EXPECT_LT(plan::lateral_clearance(*world, tube_over_field(world->reach, there, held.front(), held, world->bounds)),
              0);
    map::OccupancyGrid changed = grid;
    changed.set({5, 5, 5}, map::Cell::occupied);
    const auto updated = plan::rebuilt(*world, {.grid = changed, .voxels = {{5, 5, 5}, {5, 5, 5}}});
    EXPECT_FALSE(updated->hover.safe({10, 10, 10}));
  }
}

// Casts of what is no number to voxels differ from processor to processor: on one of them it was safe to hover there.
TEST(BoundCode, AnInfiniteBoundHasAnInfiniteEllipsoid) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const HoverEllipsoid ellipsoid(*config::load_vehicle("builtin:quad-5in"));
  for (const Vec3& w_bar :
       {Vec3(1, 1, kInfinity), Vec3(kInfinity, 1, 0), Vec3(0, kInfinity, 1), Vec3(kInfinity, kInfinity, kInfinity)})
    EXPECT_EQ(ellipsoid.half_axes(w_bar), Vec3::Constant(kInfinity));
}

}  // namespace
}  // namespace backwash::reach
