// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/stop.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/types/geometry.hpp"

namespace backwash::plan {
namespace {

// A circle of radius 2 m at 1.2 m/s: every command lies on it, whatever the pace.
std::vector<Setpoint> circle(std::size_t count) {
  constexpr double r = 2, w = 0.6;
  std::vector<Setpoint> commands;
  for (std::size_t k = 0; k < count; ++k) {
    const double a = w * static_cast<double>(k) * kControlPeriod;
    const Vec3 out(std::cos(a), std::sin(a), 0), along(-std::sin(a), std::cos(a), 0);
    commands.push_back({r * out, r * w * along, -r * w * w * out, 0.3});
  }
  return commands;
}

TEST(StopAlong, KeepsTheCommandsBeforeTheBranchAndEndsAtRest) {
  const auto flown = circle(400);
  const auto stopped = stop_along(flown, 50, 2.0);
  ASSERT_GT(stopped.size(), 60u);
  for (std::size_t k = 0; k < 50; ++k) EXPECT_EQ(stopped[k].p_W, flown[k].p_W);
  EXPECT_EQ(stopped.back().v_W, Vec3::Zero());
  EXPECT_EQ(stopped.back().a_W, Vec3::Zero());
}

TEST(StopAlong, StaysOnThePathAndMovesAsItsVelocitySays) {
  const auto stopped = stop_along(circle(400), 50, 2.0);
  for (std::size_t k = 50; k + 1 < stopped.size(); ++k) {
    // The chord of a 20 ms step leaves the circle by less than 0.1 mm.
    EXPECT_NEAR(stopped[k].p_W.norm(), 2.0, 1e-4) << k;
    const Vec3 moved = (stopped[k + 1].p_W - stopped[k].p_W) / kControlPeriod;
    EXPECT_LT((moved - (stopped[k].v_W + stopped[k + 1].v_W) / 2).norm(), 5e-3) << k;
    EXPECT_LE(stopped[k + 1].v_W.norm(), stopped[k].v_W.norm() + 1e-9) << k;
    EXPECT_LE((stopped[k + 1].v_W - stopped[k].v_W).cwiseAbs().maxCoeff() / kControlPeriod, 2.0) << k;
  }
}

// Turning at 0.6 rad/s along the circle: the heading belongs to the place, so it turns no faster and ends its turn
// without steps when the path ends.
TEST(StopAlong, TurnsWithThePathAndComesToRestInHeadingToo) {
  auto flown = circle(400);
  for (std::size_t k = 0; k < flown.size(); ++k) flown[k].yaw = 0.6 * static_cast<double>(k) * kControlPeriod;
  const auto stopped = stop_along(flown, 50, 2.0);
  double rate = 0.6;
  for (std::size_t k = 50; k < stopped.size(); ++k) {
    EXPECT_NEAR(stopped[k].yaw, std::atan2(stopped[k].p_W.y(), stopped[k].p_W.x()), 1e-4) << k;
    const double next = (stopped[k].yaw - stopped[k - 1].yaw) / kControlPeriod;
    EXPECT_LT(std::abs(next - rate) / kControlPeriod, 0.6) << k;  // 1.2 m/s stops at 1 m/s² at most, on a radius of 2 m
    rate = next;
  }
  EXPECT_LT(rate, 1e-3);
}

TEST(StopAlong, HasNothingToSayPastTheEnd) { EXPECT_TRUE(stop_along(circle(30), 30, 2.0).empty()); }

}  // namespace
}  // namespace backwash::plan
