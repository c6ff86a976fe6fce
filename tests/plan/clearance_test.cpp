// SPDX-License-Identifier: BSD-3-Clause
// The clearance of tubes that the planner's verification rests on: against the prism queries of core/reach step by
// step, and in closed form beside a pillar.
#include <gtest/gtest.h>

#include <random>

#include "core/config/config.hpp"
#include "core/plan/planner.hpp"
#include "core/reach/clearance.hpp"

namespace backwash::plan {
namespace {

using map::Cell;
using map::OccupancyGrid;

const Vehicle& vehicle() {
  static const Vehicle v = config::load_vehicle("builtin:quad-5in").value();
  return v;
}
double body() { return vehicle().body.radius + vehicle().estimation.position; }

/// 4 × 4 × 2 m of free space at 0.1 m; outside it nothing is known.
OccupancyGrid open_room() { return {Vec3::Zero(), 0.1, {40, 40, 20}, Cell::free}; }
void fill_voxels(OccupancyGrid& grid, const Index3& low, const Index3& high, Cell cell = Cell::occupied) {
  for (int k = low.z(); k <= high.z(); ++k)
    for (int j = low.y(); j <= high.y(); ++j)
      for (int i = low.x(); i <= high.x(); ++i) grid.set({i, j, k}, cell);
}
std::shared_ptr<const World> world_around(OccupancyGrid grid, std::optional<double> margin = std::nullopt) {
  return build_world(std::move(grid), Model{}, vehicle(), reach::Method::tight, margin);
}

/// Sets of one half width, whose instants are far smaller than their intervals.
reach::ReachTube tube_along(const std::vector<Vec3>& centers, double half_width = 0.05) {
  reach::ReachTube tube(centers.size());
  for (std::size_t k = 0; k < tube.size(); ++k) {
    tube[k].t = static_cast<double>(k) * kControlPeriod;
    tube[k].center.p_W = centers[k];
    tube[k].half_widths.fill(0.01);
    tube[k].half_widths_interval.fill(half_width);
    tube[k].half_widths_interval[kXyPlus] = tube[k].half_widths_interval[kXyMinus] = half_width * std::sqrt(2.0);
  }
  return tube;
}

/// Random flights through random clutter; the clearance of each step taken by itself, without a limit.
void expect_equal_to_each_step_by_itself(std::optional<double> margin) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> u(0, 1);
  OccupancyGrid grid = open_room();
  for (int n = 0; n < 60; ++n)
    grid.set(grid.index({4 * u(random), 4 * u(random), 2 * u(random)}),
             u(random) < 0.5 ? Cell::occupied : Cell::unknown);
  const auto world = world_around(grid, margin);
  int positive = 0;
  for (int flight = 0; flight < 60; ++flight) {
    Vec3 p(0.5 + 3 * u(random), 0.5 + 3 * u(random), 0.4 + 1.2 * u(random));
    const Vec3 step = 0.1 * Vec3(u(random) - 0.5, u(random) - 0.5, 0.3 * (u(random) - 0.5));
    std::vector<Vec3> centers;
    for (int k = 0; k < 25; ++k, p += step) centers.push_back(p);
    auto tube = tube_along(centers, 0.02 + 0.1 * u(random));
    for (auto& s : tube) s.half_widths_interval[kZ] *= 0.3 + u(random);
    double expected = 2.0;
    for (std::size_t k = 0; k < tube.size(); ++k) {
      const PerDirection h = margin ? PerDirection{} : tube[k].half_widths_interval;
      const Vec3& to = tube[std::min(k + 1, tube.size() - 1)].center.p_W;
      expected = std::min(
          expected, reach::swept_prism_distance(grid, tube[k].center.p_W, to, h, 9.0) - body() - margin.value_or(0.0));
    }
    EXPECT_NEAR(tube_clearance(*world, tube), expected, 1e-9) << flight;
    positive += expected > 0;
  }
  EXPECT_GT(positive, 10);
  EXPECT_LT(positive, 55);
}

TEST(TubeClearance, IsTheLeastOfItsStepsEachTakenByItself) { expect_equal_to_each_step_by_itself({}); }
TEST(TubeClearance, WithAConstantMarginIsTheLeastOfItsStepsToo) { expect_equal_to_each_step_by_itself(0.1); }

/// A pillar whose near face is at x = 2.5, in the given layers.
OccupancyGrid pillar(int lowest, int highest) {
  OccupancyGrid grid = open_room();
  fill_voxels(grid, {25, 19, lowest}, {26, 20, highest});
  return grid;
}

TEST(LateralClearance, BesideAPillarIsTheGapLessSetBodyAndEstimation) {
  const auto world = world_around(pillar(0, 19));
  const auto at = [&](double x, double half_width) {
    return lateral_clearance(*world, tube_along({{x, 2, 0.6}, {x, 2, 0.6}}, half_width));
  };
  EXPECT_NEAR(at(1.6, 0.05), 0.9 - 0.05 - body(), 1e-9);
  EXPECT_NEAR(at(1.6, 0.2), 0.9 - 0.2 - body(), 1e-9);
  EXPECT_NEAR(lateral_clearance(*world, tube_along({{1.6, 2, 0.6}, {1.7, 2, 0.6}})), 0.8 - 0.05 - body(), 1e-9)
      << "the set is swept to the next one";
  // Past the pillar at x = 2.3 in one step, neither end nor the middle of which is beside it.
  EXPECT_NEAR(lateral_clearance(*world, tube_along({{2.3, 0.8, 0.6}, {2.3, 2.5, 0.6}})), 0.2 - 0.05 - body(), 1e-9);
  const auto with_margin = world_around(pillar(0, 19), 0.3);
  EXPECT_NEAR(lateral_clearance(*with_margin, tube_along({{1.6, 2, 0.6}, {1.6, 2, 0.6}})), 0.9 - 0.3 - body(), 1e-9);
}

TEST(LateralClearance, CountsTheLayersBesideBodyAndSetAndNoOthers) {
  // The body's upper edge at 0.6 + 0.05 + 0.18 = 0.83 m: layer 8.
  const auto tube = tube_along({{1.6, 2, 0.6}, {1.6, 2, 0.6}});
  const double beside = 0.9 - 0.05 - body();
  for (const int layer : {4, 6, 8})
    EXPECT_NEAR(lateral_clearance(*world_around(pillar(layer, layer)), tube), beside, 1e-9);
  for (const int layer : {2, 9, 12}) EXPECT_NEAR(lateral_clearance(*world_around(pillar(layer, layer)), tube), 1, 1e-9);
}

TEST(LateralClearance, IsThatOfTouchingWhereTheCentreIsNotInFreeSpace) {
  for (const Cell cell : {Cell::occupied, Cell::unknown}) {
    OccupancyGrid grid = open_room();
    fill_voxels(grid, {16, 20, 10}, {16, 20, 10}, cell);
    const auto tube = tube_along({{1.65, 2.05, 0.6}, {1.65, 2.05, 1.05}, {1.65, 2.05, 1.05}});
    EXPECT_NEAR(lateral_clearance(*world_around(grid), tube), -body(), 1e-9);
  }
}

TEST(TakeoffClearance, IsBesideItBelowTheSafeHeightAndAllAroundAboveIt) {
  std::vector<Vec3> up;
  for (int k = 0; k <= 20; ++k) up.emplace_back(1.5, 2, 0.2 + 0.05 * k);  // to 1.2 m
  const auto tube = tube_along(up, 0.05);
  OccupancyGrid low = open_room();
  fill_voxels(low, {19, 20, 0}, {19, 20, 3});  // beside it, below the safe height
  // The last set below it, swept up to the next, is beside the pillar; above it the pillar's top is farther away.
  EXPECT_NEAR(takeoff_clearance(*world_around(low), tube, 0.63), 0.4 - 0.05 - body(), 1e-9);
  OccupancyGrid ceiling = open_room();
  fill_voxels(ceiling, {13, 18, 16}, {17, 22, 16});
  EXPECT_NEAR(takeoff_clearance(*world_around(ceiling), tube, 0.53), 1.6 - 1.2 - 0.05 - body(), 1e-9);
  EXPECT_NEAR(takeoff_clearance(*world_around(ceiling), tube_along({up.begin(), up.begin() + 5}), 0.53),
              0.4 - 0.05 - body(), 1e-9)
      << "a place of rest is not excused its floor";
}

TEST(TakeoffColumn, IsTheSameFromEveryHeightAboveItsFloor) {
  OccupancyGrid grid = open_room();
  fill_voxels(grid, {0, 0, 0}, {39, 39, 2});  // the floor's top at 0.3 m
  const auto world = world_around(grid);
  const auto lowest = takeoff_column(*world, {1.5, 2, 0.35}, 0);
  ASSERT_TRUE(lowest);
  EXPECT_NEAR(lowest->z_floor, 0.3, 1e-9);
  for (const double z : {0.7, 1.1, 1.6}) {
    const auto column = takeoff_column(*world, {1.5, 2, z}, 0);
    ASSERT_TRUE(column) << z;
    EXPECT_NEAR(column->z_floor, 0.3, 1e-9);
    EXPECT_NEAR(column->z_safe, lowest->z_safe, 1e-9);
  }
}

}  // namespace
}  // namespace backwash::plan
