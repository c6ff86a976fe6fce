// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "core/plan/world/gain_sweep.hpp"

namespace backwash::plan {
namespace {

using map::Cell;
using map::OccupancyGrid;

Vehicle slow_loop() {
  Vehicle v;
  v.body = {0.15, 0.17, 0.06, 0.7};
  v.controller.kp = {10, 12};
  v.controller.kd = {5.5, 6};
  v.controller.latency = v.controller.feedback_delay = 0.01;
  v.controller.attitude_lag = 0.05;
  v.estimation.position = 0.01;
  v.limits = {1.5, 2};
  v.initial_error = {0.05, 0.1};
  return v;
}

/// A room 6 m long whose middle wall has a door of this width, and the same air everywhere.
std::shared_ptr<const World> room_with_door(double width, double variance) {
  constexpr double kVoxel = 0.1;
  OccupancyGrid grid({0, 0, 0}, kVoxel, {60, 30, 24}, Cell::free);
  const int half = static_cast<int>(std::lround(width / 2 / kVoxel));
  for (int k = 0; k < 24; ++k)
    for (int j = 0; j < 30; ++j)
      if (j < 15 - half || j >= 15 + half) grid.set({30, j, k}, Cell::occupied);
  Model model;
  model.base.horizontal = model.base.vertical = variance;
  return build_world(std::move(grid), model, slow_loop());
}
const Vec3 kStart(1.55, 1.55, 1.25), kGoal(4.55, 1.55, 1.25);

// The half width of a hover set is proportional to Σ's root: in the air of double the deviation it is double.
TEST(GainSweep, SetsOfTheSameGainsAreThoseOfTheWorld) {
  const auto world = room_with_door(1.2, 0.01);
  const GainStep same = with_gains(*world, kStart, kGoal, 1);
  ASSERT_TRUE(same.stable && same.way);
  const auto set = reach::hover_set(world->reach, world->grid, world->distance, world->bounds, same.way->place_W);
  for (std::size_t d = 0; d < set.half_widths.size(); ++d) EXPECT_EQ(same.set.half_widths[d], set.half_widths[d]);
  EXPECT_EQ(same.kp.horizontal, 10);
}

TEST(GainSweep, FasterGainsMakeSmallerSetsUntilDelayMakesTheLoopUnstable) {
  const auto world = room_with_door(1.2, 0.01);
  const GainStep slow = with_gains(*world, kStart, kGoal, 0.7), same = with_gains(*world, kStart, kGoal, 1);
  ASSERT_TRUE(slow.set.bounded && same.set.bounded);
  EXPECT_GT(slow.set.half_widths[0], 1.2 * same.set.half_widths[0]);
  EXPECT_NEAR(slow.kp.vertical, 0.49 * 12, 1e-12);
  EXPECT_NEAR(slow.kd.vertical, 0.7 * 6, 1e-12);
  EXPECT_FALSE(with_gains(*world, kStart, kGoal, 10).stable);
  EXPECT_FALSE(with_gains(*world, kStart, kGoal, 10).passable());
}

// Without delay, gains (f² k_p, f k_d) are the same loop f times as fast, and its response to w is 1/f² as large: where
// the air is the same everywhere, the set of a disturbance of any course within its bound is a quarter at f = 2.
TEST(GainSweep, WithoutDelayTwiceAsFastIsAQuarterOfTheSet) {
  Vehicle v = slow_loop();
  v.controller.latency = v.controller.feedback_delay = v.controller.attitude_lag = 0;
  v.estimation.position = 0;
  Model model;
  model.base.horizontal = model.base.vertical = 0.01;
  model.ground.l_max = model.ground.l_footprint_max = model.corner.l_max = model.wall.l_max = 0;
  const auto world = plan::build_world(OccupancyGrid({0, 0, 0}, 0.1, {60, 30, 24}, Cell::free), model, v);
  const GainStep slow = with_gains(*world, kStart, kGoal, 1), fast = with_gains(*world, kStart, kGoal, 2);
  ASSERT_TRUE(slow.set.bounded && fast.set.bounded);
  for (std::size_t d = 0; d < slow.set.half_widths.size(); ++d)
    EXPECT_NEAR(fast.set.half_widths[d] / slow.set.half_widths[d], 0.25, 0.04) << d;
}

// At the smallest gains that pass, a little less does not.
TEST(GainSweep, TheSmallestGainsAreFoundToOnePercent) {
  const auto world = room_with_door(0.6, 0.2);
  const GainSweep sweep = sweep_gains(*world, kStart, kGoal, {0.5, 1, 2});
  ASSERT_TRUE(sweep.smallest);
  ASSERT_GT(sweep.smallest->factor, 0.5);
  EXPECT_TRUE(sweep.smallest->passable());
  EXPECT_FALSE(with_gains(*world, kStart, kGoal, sweep.smallest->factor / 1.011).passable());
  EXPECT_EQ(sweep.steps.size(), 3u);
}

TEST(GainSweep, ADoorThatTheBodyAloneDoesNotPassIsPassedWithNoGains) {
  const auto world = room_with_door(0.2, 0.01);
  const GainSweep sweep = sweep_gains(*world, kStart, kGoal, {0.5, 1, 2});
  EXPECT_FALSE(sweep.smallest);
}

}  // namespace
}  // namespace backwash::plan
