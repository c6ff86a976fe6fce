// SPDX-License-Identifier: BSD-3-Clause
// What the tick makes of odometry, with a vehicle that flies perfectly in a controller's frame that is
// turned and moved against the map.
#include <numbers>

#include "tests/track/flown/flown.hpp"

namespace backwash::track::test {
namespace {

TEST(TickReactions, AJumpFreezesAndGoodSamplesAfterItAreNotBelieved) {
  Flown f;
  const Vec3 last = f.out.command.p_W;
  f.spoil = [](auto& s) { s.state.p_W.y() += 0.5; };
  f.step();
  EXPECT_EQ(f.out.supervisor.reason, Reason::odometry_jump);
  f.spoil = nullptr;  // as good as before
  expect_frozen_then_land(f, last);
}

TEST(TickReactions, OdometryThatStopsHoldsWithin100MillisecondsOfItsReception) {
  Flown f;
  f.vio_on = false;
  int ticks = 0;
  while (f.out.supervisor.mode == Mode::tracking && ticks < 20) {
    f.step();
    ++ticks;
  }
  EXPECT_EQ(ticks, 5);
  EXPECT_EQ(f.out.supervisor.reason, Reason::odometry_lost);
}

TEST(TickReactions, FourStampsThatDoNotRiseHoldAndThreeDoNot) {
  Flown f;
  const std::int64_t stamp = f.in.now_ns;
  f.spoil = [=](auto& s) { s.stamp_ns = stamp; };
  for (int n = 0; n < 3; ++n) EXPECT_EQ(f.step().supervisor.mode, Mode::tracking) << n;
  EXPECT_EQ(f.step().supervisor.mode, Mode::hold);
  EXPECT_EQ(f.out.supervisor.reason, Reason::odometry_disorder);
}

TEST(TickReactions, TheErrorIsJudgedForATicksOwnSampleOnly) {
  Flown f;
  EXPECT_TRUE(f.step().inside.judged);
  f.vio_on = false;
  EXPECT_FALSE(f.step().inside.judged);
}

TEST(TickReactions, ALowBatteryLands) {
  Flown f;
  f.in.autopilot.battery = 0.16;
  EXPECT_EQ(f.step().supervisor.mode, Mode::tracking);
  f.in.autopilot.battery = 0.14;
  EXPECT_EQ(f.step().supervisor.mode, Mode::land);
}

// At 1 m/s and 1 rad/s a sample of 15 ms ago lies 1.5 cm and 0.9° behind the controller's pose of now, and the
// controller's of 15 ms ago as much behind a sample of now.
TEST(TickReactions, TheOdometryIsComparedWithTheAutopilotAtOneMoment) {
  constexpr std::int64_t kLate_ns = 15'000'000;
  for (const auto& [vio, pose] :
       {std::pair{kLate_ns, 0L}, std::pair{0L, kLate_ns}, std::pair{kLate_ns / 3, kLate_ns}}) {
    Flown f(Flown::Until::tracking);
    f.age_ns = vio;
    f.pose_age_ns = pose;
    f.yaw_rate = 1;
    f.offer(f.segment);
    for (int n = 0; n < 100; ++n) f.step();
    ASSERT_EQ(f.out.supervisor.mode, Mode::tracking);
    EXPECT_LT(f.tick.alignment().position_residual(), 0.003) << vio << " and " << pose;
    EXPECT_LT(std::abs(f.tick.alignment().yaw_residual()), 0.003) << vio << " and " << pose;
  }
}

TEST(TickReactions, WhileNothingIsCommandedAVioMayStartAnewElsewhere) {
  Flown f(Flown::Until::aligned);
  ASSERT_TRUE(f.out.fresh);
  const int before = f.out.odometry_resets;
  f.spoil = [](auto& s) { s.state.p_W.x() += 5; };
  EXPECT_FALSE(f.step().fresh);
  EXPECT_TRUE(f.step().fresh);
  EXPECT_EQ(f.out.odometry_resets, before + 1) << "the autopilot's estimator has to know";
}

TEST(TickReactions, ASetpointThatIsNoNumberIsNotSent) {
  for (const int part : {0, 1, 2, 3}) {
    Flown f(Flown::Until::tracking);
    for (auto& c : f.segment.commands) {
      if (part == 0) c.p_W.z() = kNan;
      if (part == 1) c.v_W.x() = kNan;
      if (part == 2) c.a_W.y() = kNan;
      if (part == 3) c.yaw = kNan;
    }
    f.offer(f.segment);
    ASSERT_TRUE(f.out.accepted);
    EXPECT_FALSE(f.out.finite) << part;
    EXPECT_FALSE(f.out.supervisor.send_setpoint) << part;
  }
}

TEST(TickReactions, OdometryThatIsLateByItsOwnStampsIsAsOldAsThat) {
  Flown f(Flown::Until::tracking);
  int n = 0;
  f.spoil = [&](auto& s) { s.stamp_ns -= n * 1'000'000; };
  for (n = 1; n < 200 && f.out.supervisor.mode == Mode::tracking; ++n) f.step();
  EXPECT_EQ(f.out.supervisor.reason, Reason::odometry_lost);
  EXPECT_NEAR(n, 81, 3);
}

// The controller follows the VIO, so that the frames agree: only the velocities contradict it.
TEST(TickReactions, PositionsThatGoAnotherWayThanTheirVelocitiesHold) {
  Flown f(Flown::Until::tracking);
  Vec3 drift = Vec3::Zero();
  f.spoil = [&](auto& s) { s.state.p_W += drift; };
  for (int n = 0; n < 100 && f.out.supervisor.mode == Mode::tracking; ++n) {
    drift.y() += 0.004;
    f.local_off = RigidShift{Flown::kYaw, Vec3::Zero()}.rotate(drift);
    f.step();
  }
  EXPECT_EQ(f.out.supervisor.reason, Reason::odometry_inconsistent);
}

// Slow enough for the gate. Nothing says that the controller's own estimate was reset.
TEST(TickReactions, ATurningVioIsNotTakenForAResetOfTheController) {
  Flown f(Flown::Until::tracking);
  const Vec3 local = f.out.command_local.p_W;
  double yaw = 0;
  f.spoil = [&](auto& s) { s.q = Flown::quaternion(yaw); };
  for (int n = 0; n < 60; ++n) {
    yaw = std::min(yaw + 0.05, 1.0);
    f.step();
    EXPECT_NE(f.out.supervisor.reason, Reason::autopilot_reset);
    EXPECT_LT((f.out.command_local.p_W - local).norm(), 1e-9) << n;
  }
  EXPECT_NE(f.out.supervisor.mode, Mode::tracking);
}

// It claims a flight that the vehicle could fly; the controller's own estimate stands still and did not jump.
TEST(TickReactions, AVioThatFliesAwayIsNotTakenForAResetOfTheController) {
  Flown f(Flown::Until::tracking);
  const Vec3 local = f.out.command_local.p_W;
  double off = 0, v = 0;
  std::optional<Reason> held;
  f.spoil = [&](auto& s) {
    s.state.p_W.y() += off;
    s.state.v_W.y() += v;
  };
  for (int n = 0; f.out.supervisor.mode != Mode::land && n < 60; ++n) {
    const double before = v;
    v = std::min(v + 0.4, 1.4);
    off += kControlPeriod * (before + v) / 2;
    f.step();
    if (!held && f.out.supervisor.mode == Mode::hold) held = f.out.supervisor.reason;
    EXPECT_LT((f.out.command_local.p_W - local).norm(), 1e-9) << n;
  }
  EXPECT_EQ(held, Reason::frames_apart);
  EXPECT_EQ(f.out.supervisor.mode, Mode::land) << to_string(f.out.supervisor.reason);
}

TEST(TickReactions, AnAttitudeThatStopsArrivingHoldsAlsoWhileThePositionComes) {
  Flown f(Flown::Until::tracking);
  f.attitude_on = false;
  int ticks = 0;
  for (; f.out.supervisor.mode == Mode::tracking && ticks < 30; ++ticks) f.step();
  EXPECT_EQ(f.out.supervisor.reason, Reason::pose_silent);
  EXPECT_EQ(ticks, 15);
}

TEST(TickReactions, WhileTheAutopilotsPoseIsSilentNothingIsFlownAndThenItLands) {
  Flown f(Flown::Until::tracking);
  f.attitude_on = false;
  for (int n = 0; f.out.supervisor.mode == Mode::tracking && n < 30; ++n) f.step();
  ASSERT_EQ(f.out.supervisor.reason, Reason::pose_silent);
  const Vec3 held = f.out.command.p_W;
  AcceptedSegment s = straight();
  s.tube.front().center = Flown::map_of(f.truth_L);
  EXPECT_TRUE(f.offer(s).refused) << "an operator's next command";
  for (int n = 0; f.out.supervisor.mode == Mode::hold && n < 60; ++n) EXPECT_EQ(f.step().command.p_W, held) << n;
  EXPECT_EQ(f.out.supervisor.reason, Reason::pose_lost);
}

}  // namespace
}  // namespace backwash::track::test
