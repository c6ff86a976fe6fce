// SPDX-License-Identifier: BSD-3-Clause
// Rows 41 and 42 of docs/faults.md in lockstep: a VIO whose frame turns, tilts or rescales, and an autopilot that falls
// silent. With an autopilot that keeps its own heading and with one that takes it from the VIO.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstdio>
#include <functional>
#include <numbers>
#include <random>

#include "core/sim/flight.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

/// What a wrong frame makes of a sample, about the place where the vehicle was when it went wrong.
struct Wrong {
  std::string name;
  std::function<Mat3(double t)> linear;  ///< of positions; t: s since it went wrong
  bool velocity = true;                  ///< the velocities are as wrong
  bool attitude = false;                 ///< and the attitude: linear is a rotation then
};

Wrong turned(double angle, const Vec3& axis, bool whole) {
  const Mat3 R = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  return {"", [R](double) { return R; }, whole, whole};
}

Wrong scaled(const Vec3& scale, bool whole) {
  const Mat3 S = scale.asDiagonal();
  return {"", [S](double) { return S; }, whole, false};
}

struct Course {
  int ticks_to_hold = -1;
  Reason reason = Reason::started;
  double off = 0;      ///< largest horizontal distance of the true vehicle from its route, m
  bool down = false;   ///< landed by itself
  bool moved = false;  ///< a set-point after the hold went elsewhere horizontally
};

double from_route(const std::vector<Setpoint>& route, const Vec3& p) {
  double least = 1e9;
  for (const Setpoint& c : route) least = std::min(least, (c.p_W - p).head<2>().norm());
  return least;
}

/// Flies at 1.4 m/s, spoils the frame, and follows what the vehicle really does for ten seconds.
Course fly_with(const Wrong& wrong, bool follows_yaw) {
  Lockstep rig;
  rig.autopilot->follows_yaw = follows_yaw;
  rig.take_off();
  rig.start_route(0.02);
  while (rig.view().command.v_W.norm() < 1.39 && rig.mode() == Mode::tracking) rig.tick();
  EXPECT_EQ(rig.mode(), Mode::tracking) << to_string(rig.reason());
  std::optional<OdometrySample> pivot;
  Vec3 integrated = Vec3::Zero();
  Mat3 before = Mat3::Identity();
  Vec3 true_before = Vec3::Zero();
  rig.spoil = [&](OdometrySample& s) {
    if (!pivot) {
      pivot = s;
      integrated = true_before = s.state.p_W;
    }
    const double t = static_cast<double>(s.stamp_ns - pivot->stamp_ns) * 1e-9;
    const Mat3 M = wrong.linear(t);
    // A frame that goes wrong by and by carries its positions on from where they are.
    integrated += 0.5 * (before + M) * (s.state.p_W - true_before);
    true_before = s.state.p_W;
    before = M;
    s.state.p_W = integrated;
    if (wrong.velocity) s.state.v_W = M * s.state.v_W;
    if (!wrong.attitude) return;
    const Eigen::Quaterniond q = Eigen::Quaterniond(M) * Eigen::Quaterniond(s.q[0], s.q[1], s.q[2], s.q[3]);
    s.q = {q.w(), q.x(), q.y(), q.z()};
  };
  Course course;
  std::optional<Vec3> held;
  for (int n = 0; n < 500; ++n) {
    rig.tick();
    course.off = std::max(course.off, from_route(rig.route(), rig.autopilot->truth().p_W));
    course.down = !rig.autopilot->armed();
    if (course.ticks_to_hold < 0 && rig.mode() != Mode::tracking) {
      course.ticks_to_hold = n;
      course.reason = rig.reason();
    }  // the first sample only sets the pivot
    if (rig.mode() != Mode::hold || rig.wire().setpoints.empty()) continue;
    const Vec3 p = rig.in_map(rig.wire().setpoints[0]).p_W;
    if (held && (p - *held).head<2>().norm() > 1e-3) course.moved = true;
    held = p;
  }
  return course;
}

void print(const std::string& what, bool follows_yaw, const Course& c) {
  std::printf("| %-34s | %-7s | %4d | %-43s | %5.2f |\n", what.c_str(), follows_yaw ? "follows" : "own",
              c.ticks_to_hold, to_string(c.reason), c.off);
}

std::string with(const char* what, double value) {
  char text[64];
  std::snprintf(text, sizeof text, what, value);
  return text;
}

/// Held on a pose that is not trusted, no new horizontal position, landed within `off` of the route.
void expect_safe(const std::string& what, const Wrong& wrong, int ticks, double off) {
  for (const bool follows_yaw : {false, true}) {
    const Course c = fly_with(wrong, follows_yaw);
    print(what, follows_yaw, c);
    EXPECT_GE(c.ticks_to_hold, 0) << what << " is flown to the end";
    EXPECT_LE(c.ticks_to_hold, ticks) << what;
    // One that leaves its set first stops on its verified way, and rests there: then nothing speaks against the pose.
    EXPECT_TRUE(!c.moved || c.reason == Reason::outside_set) << what;
    EXPECT_TRUE(c.down || c.reason == Reason::outside_set) << what;
    EXPECT_LT(c.off, off) << what;
  }
}

TEST(VioFrameFault, AFrameThatTurnsIsHeldAtOnceAndNotFlown) {
  for (const double angle : {10., 20., 45., 90., 135., 180., -10., -90.})
    expect_safe(with("turned by %.0f°", angle), turned(angle * kDegree, Vec3::UnitZ(), true), 2, 0.2);
}

TEST(VioFrameFault, AFrameThatTiltsIsHeld) {
  for (const double angle : {10., 20., 45., 90., 180.}) {
    const int ticks = angle < 20 ? 8 : 3;
    expect_safe(with("tilted by %.0f° about x", angle), turned(angle * kDegree, Vec3::UnitX(), true), ticks, 0.2);
    expect_safe(with("tilted by %.0f° about y", angle), turned(angle * kDegree, Vec3::UnitY(), true), ticks, 0.2);
  }
}

TEST(VioFrameFault, PositionsThatGoAnotherWayThanTheVelocitiesAreHeld) {
  for (const double angle : {10., 20., 45., 90., 180.})
    expect_safe(with("positions turned by %.0f°", angle), turned(angle * kDegree, Vec3::UnitZ(), false), 30, 0.3);
  for (const double scale : {0.5, 0.8, 0.9, 1.1, 1.25, 2.0})
    expect_safe(with("positions scaled by %.2f", scale), scaled(Vec3::Constant(scale), false), 60, 0.3);
  expect_safe("positions frozen along x", scaled({0, 1, 1}, false), 8, 0.3);
  expect_safe("positions mirrored along x", scaled({-1, 1, 1}, false), 5, 0.3);
}

TEST(VioFrameFault, PositionsAndVelocitiesThatAreRescaledTogetherAreHeldAtTheStepOfTheVelocity) {
  for (const double scale : {0.5, 0.65, 1.35, 2.0})
    expect_safe(with("all scaled by %.2f", scale), scaled(Vec3::Constant(scale), true), 2, 0.3);
  expect_safe("all frozen along x", scaled({0, 1, 1}, true), 2, 0.3);
  expect_safe("all mirrored along x", scaled({-1, 1, 1}, true), 2, 0.3);
}

TEST(VioFrameFault, AFrameThatTurnsByAndByDisagreesBeforeAWallIsReached) {
  for (const double rate : {2., 5., 10., 30., 90., -10.}) {
    const Wrong wrong{"",
                      [=](double t) { return Eigen::AngleAxisd(rate * t * kDegree, Vec3::UnitZ()).toRotationMatrix(); },
                      true, true};
    expect_safe(with("turning by %.0f°/s", rate), wrong, 200, 0.3);
  }
}

TEST(VioFrameFault, PositionsThatRescaleByAndByAreHeld) {
  for (const double rate : {-0.1, 0.1, -0.5, 0.5}) {
    const Wrong wrong{"", [=](double t) -> Mat3 { return std::max(0.2, 1 + rate * t) * Mat3::Identity(); }, false,
                      false};
    expect_safe(with("positions rescaling by %.1f/s", rate), wrong, 200, 0.3);
  }
}

TEST(AutopilotPoseFault, WithoutTheAutopilotsPositionOrAttitudeItHoldsAfter300MillisecondsAndLandsAfterOneSecond) {
  for (const bool attitude : {false, true}) {
    InFlight rig;
    (attitude ? rig.autopilot->silent_attitude : rig.autopilot->silent_pose) = true;
    EXPECT_EQ(rig.ticks_until(Mode::hold, 50), 15);
    EXPECT_EQ(rig.reason(), Reason::pose_silent);
    EXPECT_EQ(rig.ticks_until(Mode::land, 50), 50 - 15);
    EXPECT_EQ(rig.reason(), Reason::pose_lost);
    EXPECT_TRUE(rig.wire().commanded(kCommandLand));
    for (int n = 0; n < 300; ++n) EXPECT_TRUE(rig.tick().setpoints.empty());
    EXPECT_FALSE(rig.autopilot->armed());
    EXPECT_LT(from_route(rig.route(), rig.autopilot->truth().p_W), 0.1);
  }
}

TEST(AutopilotPoseFault, AShortSilenceIsBridgedAndAHoldAfterALongerOneTakesANewFlight) {
  InFlight rig(1);
  rig.autopilot->silent_pose = true;
  rig.ticks(14);
  rig.autopilot->silent_pose = false;
  rig.ticks(20);
  EXPECT_EQ(rig.mode(), Mode::tracking) << to_string(rig.reason());
  rig.autopilot->silent_pose = true;
  EXPECT_EQ(rig.ticks_until(Mode::hold, 50), 15);
  rig.ticks(5);
  rig.autopilot->silent_pose = false;
  rig.ticks(250);
  EXPECT_EQ(rig.mode(), Mode::hold);
  rig.offer(sim::hold_commands(rig.view().command.p_W, 1));
  rig.ticks(2);
  EXPECT_EQ(rig.mode(), Mode::tracking) << to_string(rig.reason());
}

TEST(AutopilotPoseFault, EnableIsRefusedOnAnOldPose) {
  for (const bool attitude : {false, true}) {
    Lockstep rig;
    rig.ticks(60);
    (attitude ? rig.autopilot->silent_attitude : rig.autopilot->silent_pose) = true;
    rig.ticks(16);
    for (const int later : {0, 500}) {
      rig.ticks(later);
      EXPECT_TRUE(rig.channels->orders.push({track::Request::enable}));
      rig.ticks(2);
      EXPECT_EQ(rig.mode(), Mode::passive);
      EXPECT_EQ(rig.reason(), Reason::pose_silent);
    }
  }
}

// Row 43, from the other side: numbers of the autopilot that no vehicle has are as silence.
TEST(AutopilotPoseFault, APoseOfTheAutopilotThatCannotBeIsAsNone) {
  for (const float far : {3e38F, -3e38F, 2e4F}) {
    InFlight rig;
    rig.autopilot->silent_pose = true;
    int ticks = 0;
    for (; rig.mode() == Mode::tracking && ticks < 50; ++ticks) {
      rig.say(mavlink::LocalPositionNed{.time_boot_ms = 1'000'000, .x = far});
      rig.tick();
    }
    EXPECT_EQ(rig.reason(), Reason::pose_silent);
    EXPECT_EQ(ticks, 15);
    EXPECT_GT(rig.link().telemetry().broken, 10u);
  }
}

}  // namespace
}  // namespace backwash::daemon::test
