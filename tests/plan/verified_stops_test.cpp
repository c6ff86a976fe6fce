// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/planner.hpp"
#include "core/plan/stop.hpp"
#include "core/plan/verified_stops.hpp"
#include "core/reach/rest.hpp"
#include "core/types/geometry.hpp"

namespace backwash::plan {
namespace {

/// A flight along the corridor at 1 m/s, and its stops from its first command on, every 0.2 s.
class VerifiedStops : public testing::Test {
 protected:
  static constexpr std::size_t kEvery = 10;
  const Vehicle vehicle_ = config::load_vehicle("builtin:quad-5in").value();
  const std::shared_ptr<const World> world_ =
      build_world(map::builtin_scene("parallel-walls-4m", 0.2).value(), Model{}, vehicle_);
  std::vector<Setpoint> commands_;
  State start_{{-2, 0, 1.2}, {1, 0, 0}};

  VerifiedStops() {
    for (int k = 0; k < 150; ++k) commands_.push_back({{-2 + 0.02 * k, 0, 1.2}, {1, 0, 0}, Vec3::Zero(), 0});
  }
  std::vector<Stop> stops(const std::function<double(const reach::ReachTube&)>& clearance) const {
    return verified_stops(*world_, start_, commands_.front(), commands_, 0, kEvery, clearance);
  }
};

TEST_F(VerifiedStops, AreThoseWhoseWholeSweptTubeIsClearAndNoOthers) {
  const auto clear_before = [](double x) {
    return [x](const reach::ReachTube& tube) { return x - tube.back().center.p_W.x(); };
  };
  const auto all = stops([](const auto&) { return 1.0; });
  ASSERT_EQ(all.size(), commands_.size() / kEvery);
  std::size_t expected = 0;
  for (const Stop& s : all) expected += s.tube.back().center.p_W.x() < 0;
  ASSERT_GT(expected, 2u);
  ASSERT_LT(expected, all.size());
  const auto some = stops(clear_before(0));
  ASSERT_EQ(some.size(), expected);
  for (std::size_t n = 0; n < expected; ++n) EXPECT_EQ(some[n].branch, all[n].branch);
  EXPECT_TRUE(stops([](const auto&) { return 0.0; }).empty()) << "touching is not clear";
  const auto first = stops([](const auto& tube) { return tube.front().center.p_W.x() < -1.9 ? 1.0 : -1.0; });
  EXPECT_EQ(first.size(), all.size()) << "the tube is the whole one, from the flight's start";
}

TEST_F(VerifiedStops, BrakeWithinTheLimitOnTheFlightsOwnPathAndRestUntilTheLoopHasSettled) {
  const std::size_t rest = reach::settling_periods(world_->reach);
  std::size_t judged = 0;
  for (const Stop& s : stops([](const auto&) { return 1.0; })) {
    // The flight's own commands end at full speed: a stop that has no room before that is not judged.
    if (s.commands.back().p_W == commands_.back().p_W) continue;
    ++judged;
    ASSERT_EQ(s.tube.size(), s.commands.size() + 1);
    ASSERT_GT(s.commands.size(), rest + 3);
    Setpoint before = commands_[s.branch];
    for (const Setpoint& c : s.commands) {
      EXPECT_LE((c.v_W - before.v_W).cwiseAbs().maxCoeff() / kControlPeriod, vehicle_.limits.a_max * (1 + 1e-9));
      EXPECT_NEAR(c.p_W.y(), 0, 1e-12);
      before = c;
    }
    for (std::size_t n = s.commands.size() - rest; n < s.commands.size(); ++n) {
      EXPECT_EQ(s.commands[n].p_W, s.commands.back().p_W);
      EXPECT_EQ(s.commands[n].v_W, Vec3::Zero());
    }
    // The braking itself ends when it has to: the rest after it is no longer than that and a period.
    EXPECT_NE(s.commands[s.commands.size() - rest - 3].p_W, s.commands.back().p_W);
  }
  EXPECT_GT(judged, 5u);
}

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
