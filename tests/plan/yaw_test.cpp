// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/spline/yaw.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/types/geometry.hpp"

namespace backwash::plan {
namespace {

/// Rest, then `angle` turned gradually while flying at `speed` m/s, then rest.
std::vector<Setpoint> bend(double speed, double angle, std::size_t count) {
  std::vector<Setpoint> commands;
  Vec3 p(0, 0, 1);
  for (std::size_t k = 0; k < count; ++k) {
    const double s = static_cast<double>(k) / static_cast<double>(count);
    const double pace = speed * std::min(1.0, 5 * std::min(s, 1 - s)), heading = angle * s;
    p += pace * kControlPeriod * Vec3(std::cos(heading), std::sin(heading), 0);
    commands.push_back({p, Vec3::Zero(), Vec3::Zero(), 0});
  }
  commands.insert(commands.end(), 50, Setpoint(commands.back()));
  return commands;
}

void expect_limited(const std::vector<Setpoint>& commands, const YawStart& start, const YawLimits& limits) {
  double yaw = start.yaw, rate = start.rate;
  for (const Setpoint& c : commands) {
    const double next = (c.yaw - yaw) / kControlPeriod;
    EXPECT_LE(std::abs(next), std::max(limits.rate, std::abs(start.rate)) + 1e-9);
    EXPECT_LE(std::abs(next - rate) / kControlPeriod, limits.acceleration + 1e-6);
    yaw = c.yaw;
    rate = next;
  }
  EXPECT_LE(std::abs(rate), limits.acceleration * kControlPeriod + 1e-9);  // at rest in the end
}

TEST(FacingAhead, KeepsTheLimitsAndFacesThePath) {
  for (const double start : {0.0, 2.0, -3.0}) {
    const auto flown = bend(1.0, 2.5, 500);
    const auto turned = facing_ahead(flown, {start, 0}, {});
    expect_limited(turned, {start, 0}, {});
    for (std::size_t k = 250; k < 400; ++k) {  // a bend of 0.25 rad/s: followed once caught up with
      const Vec3 v = flown[k + 1].p_W - flown[k].p_W;
      EXPECT_LT(std::abs(std::remainder(turned[k].yaw - std::atan2(v.y(), v.x()), 2 * std::numbers::pi)), 0.15) << k;
    }
  }
}

TEST(FacingAhead, GoesOnTurningAtTheRateItStartsWith) {
  const auto turned = facing_ahead(bend(1.0, 0.5, 300), {-1.0, 0.8}, {});
  expect_limited(turned, {-1.0, 0.8}, {});
}

TEST(FacingAhead, TurnsTheShortWayAcrossPi) {
  std::vector<Setpoint> back;  // towards −x and a little −y: heading just beyond π
  for (int k = 0; k < 300; ++k) back.push_back({Vec3(-0.02 * k, -0.002 * k, 1), Vec3::Zero(), Vec3::Zero(), 0});
  const auto turned = facing_ahead(back, {3.0, 0}, {});
  for (const Setpoint& c : turned) EXPECT_GE(c.yaw, 3.0 - 1e-9);
  EXPECT_NEAR(turned.back().yaw, std::numbers::pi + std::atan(0.1), 0.02);
}

TEST(FacingAhead, HoldsTheHeadingInHoverAndAtRateZero) {
  const std::vector<Setpoint> hover(100, Setpoint{Vec3(1, 2, 3), Vec3::Zero(), Vec3::Zero(), 0});
  for (const Setpoint& c : facing_ahead(hover, {1.2, 0}, {})) EXPECT_EQ(c.yaw, 1.2);
  for (const Setpoint& c : facing_ahead(bend(1, 2, 200), {1.2, 0}, {0, 2})) EXPECT_EQ(c.yaw, 1.2);
}

TEST(TurnedTo, ReachesTheHeadingTheShortWayWithinTheLimitsFromRestToRest) {
  const YawLimits limits{1.0, 2.0};
  for (const auto& [from, to] : {std::pair{0.0, 2.5}, {0.3, 0.32}, {3.0, -3.0}, {9.0, 0.0}}) {
    const Setpoint at{Vec3(1, 2, 3), Vec3::Zero(), Vec3::Zero(), from};
    const auto turned = turned_to(at, to, limits);
    expect_limited(turned, {from, 0}, limits);
    EXPECT_NEAR(std::remainder(turned.back().yaw - to, 2 * std::numbers::pi), 0, 1e-9);
    EXPECT_LE(std::abs(turned.back().yaw - from), std::numbers::pi);
    for (const Setpoint& c : turned) EXPECT_EQ(c.p_W, at.p_W);
  }
  EXPECT_TRUE(turned_to({Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), 1}, 1 + 2 * std::numbers::pi, limits).empty());
  EXPECT_TRUE(turned_to({}, 1, {0, 2}).empty());
}

// A path that turns until its end: the heading cannot follow it to there.
TEST(FacingAhead, IsAtRestWhenTheCommandsEnd) {
  std::vector<Setpoint> commands;
  for (int k = 0; k < 200; ++k)
    commands.push_back({{std::cos(0.02 * k), std::sin(0.02 * k), 1}, Vec3::Zero(), Vec3::Zero(), 0});
  const YawLimits limits{2, 4};
  const auto turned = facing_ahead(commands, {std::numbers::pi / 2, 1}, limits);
  EXPECT_GT(std::abs(turned[100].yaw - turned[99].yaw), 0.01) << "there is something to turn";
  EXPECT_LE(std::abs(turned[199].yaw - turned[198].yaw), limits.acceleration * kControlPeriod * kControlPeriod + 1e-9);
}

}  // namespace
}  // namespace backwash::plan
