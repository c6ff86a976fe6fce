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

// What the tick makes of frames, resets and loop closures, with a vehicle that flies perfectly in a controller's frame
// that is turned and moved against the map.

TEST(TickReactions, FramesThatDriftApartHold) {
  Flown f;
  int ticks = 0;
  for (; f.out.supervisor.mode == Mode::tracking && ticks < 200; ++ticks) {
    f.local_off.y() += 0.001;
    f.step();
  }
  // 5 cm, and three times √2 estimation.position, for neither estimate says its error.
  EXPECT_EQ(f.out.supervisor.reason, Reason::frames_apart);
  EXPECT_TRUE(f.tick.tracker().braking()) << "on a verified stop: the pose is not at fault";
  EXPECT_GT(f.local_off.y(), 0.134);
  EXPECT_LT(f.local_off.y(), 0.134 + 0.02);
  for (; f.out.supervisor.reason == Reason::frames_apart && ticks < 600; ++ticks) {
    f.local_off.y() += 0.001;
    f.step();
  }
  EXPECT_EQ(f.out.supervisor.reason, Reason::frames_disagree) << "and twice as far, at last, it is";
  EXPECT_TRUE(f.out.supervisor.freeze);
  EXPECT_GT(f.local_off.y(), 0.269);
  EXPECT_LT(f.local_off.y(), 0.269 + 0.02);
}

TEST(TickReactions, HowFarFramesMayComeApartIsWhatBothEstimatesSayWithinLimits) {
  for (const auto& [sigma, limit] : {std::pair{0.001F, 0.10}, {0.03F, 0.14}, {0.5F, 0.25}}) {
    Flown f;
    f.in.position_sigma = sigma;
    for (int n = 0; f.out.supervisor.mode == Mode::tracking && n < 400; ++n) {
      f.local_off.y() += 0.001;
      f.step();
    }
    EXPECT_EQ(f.out.supervisor.reason, Reason::frames_apart);
    EXPECT_NEAR(f.local_off.y(), limit + 0.01, 0.01) << sigma;
  }
}

TEST(TickReactions, FramesThatCameApartAreFlownInAgainOnceTheyAreTogether) {
  Flown f(Flown::Until::tracking);
  for (int n = 0; f.out.supervisor.mode == Mode::tracking && n < 400; ++n) {
    f.local_off.y() += 0.001;
    f.step();
  }
  ASSERT_EQ(f.out.supervisor.reason, Reason::frames_apart);
  AcceptedSegment s = straight();
  s.tube.front().center = Flown::map_of(f.truth_L);
  const Vec3 held = f.out.command.p_W;
  EXPECT_TRUE(f.offer(s).refused) << "still apart";
  for (int n = 0; n < 60; ++n) EXPECT_EQ(f.step().command.p_W, held) << "a hold that creeps on, command by command";
  EXPECT_EQ(f.out.supervisor.mode, Mode::hold);
  f.local_off.setZero();
  for (int n = 0; n < 30; ++n) f.step();
  AcceptedSegment next = straight();
  next.id = 2;
  next.tube.front().center = Flown::map_of(f.truth_L);
  f.offer(next);
  EXPECT_EQ(f.out.supervisor.mode, Mode::tracking) << to_string(f.out.supervisor.reason);
}

/// A second loop closure in flight: everything of the map moves by D, and nothing physically.
TEST(TickReactions, ALoopClosureMovesMapAndFlightTogetherAndNothingPhysically) {
  const RigidShift first{0.1, {1, -1, 0.2}}, second{0.13, {1.3, -1.2, 0.25}};
  Flown f(Flown::Until::aligned);
  f.closures = 1;
  f.frame_W = first;
  for (int n = 0; n < 60; ++n) f.step();  // the frames are learnt anew
  f.in.request = Request::enable;
  f.step();
  f.in.autopilot.offboard = f.in.autopilot.armed = true;
  for (int n = 0; n < 100 && f.out.supervisor.mode != Mode::tracking; ++n) f.step();
  ASSERT_EQ(f.out.supervisor.mode, Mode::tracking) << to_string(f.out.supervisor.reason);
  for (auto& c : f.segment.commands) c = first.setpoint(c);
  for (auto& t : f.segment.tube) t.center = first.state(t.center);
  f.segment.closures = 1;
  f.offer(f.segment);
  ASSERT_TRUE(f.out.accepted);
  for (int n = 0; n < 100; ++n) f.step();
  ASSERT_EQ(f.out.supervisor.mode, Mode::tracking) << to_string(f.out.supervisor.reason);

  const RigidShift D = second * first.inverse();
  const Setpoint map_before = f.out.command;
  Setpoint before = f.out.command_local;
  f.closures = 2;
  f.frame_W = second;
  for (int n = 0; n < 100; ++n) {
    f.step();
    ASSERT_EQ(f.out.supervisor.mode, Mode::tracking) << to_string(f.out.supervisor.reason) << " " << n;
    EXPECT_TRUE(f.out.fresh);
    EXPECT_TRUE(f.out.inside.inside);
    EXPECT_NEAR((f.out.command_local.p_W - before.p_W).norm(), 0.02, 1e-6) << n;
    if (n == 0) {
      EXPECT_LT((f.out.command.p_W - D.point(map_before.p_W)).norm(), 0.0201);
      EXPECT_LT((f.out.command.v_W - D.rotate(map_before.v_W)).norm(), 1e-9);
    }
    before = f.out.command_local;
  }
  EXPECT_LT(f.tick.alignment().position_residual(), 0.002);
  AcceptedSegment old = f.segment;
  old.id = 2;
  old.continues = 1;
  old.branch = 350;
  EXPECT_TRUE(f.offer(old).refused) << "it is of the map before the closure";
  old.closures = 2;
  EXPECT_TRUE(f.offer(old).accepted);
}

// The same at rest: what is held moves with the map.
TEST(TickReactions, ALoopClosureMovesWhatIsHeld) {
  const RigidShift first{0.1, {1, -1, 0.2}}, second{0.13, {1.3, -1.2, 0.25}};
  Flown f(Flown::Until::aligned);
  f.closures = 1;
  f.frame_W = first;
  for (int n = 0; n < 60; ++n) f.step();
  f.in.request = Request::enable;
  f.step();
  f.in.autopilot.offboard = f.in.autopilot.armed = true;
  for (int n = 0; n < 100; ++n) f.step();
  ASSERT_EQ(f.out.supervisor.mode, Mode::tracking) << to_string(f.out.supervisor.reason);
  const Setpoint before = f.out.command, local = f.out.command_local;
  f.closures = 2;
  f.frame_W = second;
  f.step();
  EXPECT_LT((f.out.command.p_W - (second * first.inverse()).point(before.p_W)).norm(), 1e-9);
  EXPECT_LT((f.out.command_local.p_W - local.p_W).norm(), 1e-6);
  EXPECT_NEAR(wrap_angle(f.out.command_local.yaw - local.yaw), 0, 1e-6);
}

TEST(TickReactions, WhileTheFramesDisagreeTheyAreNotTakenAnew) {
  Flown f(Flown::Until::tracking);
  f.in.autopilot.reset_counter = std::uint8_t{1};
  for (int n = 0; f.out.supervisor.reason != Reason::frames_disagree && n < 400; ++n) {
    f.local_off.y() += 0.001;
    f.step();
  }
  ASSERT_EQ(f.out.supervisor.reason, Reason::frames_disagree);
  const Vec3 local = f.out.command_local.p_W;
  f.in.autopilot.reset_counter = std::uint8_t{2};
  f.step();
  ASSERT_EQ(f.out.supervisor.mode, Mode::hold);
  EXPECT_LT((f.out.command_local.p_W - local).norm(), 1e-9);
}

/// A flight at rest in a map that has seen one loop closure already.
Flown after_a_closure(const RigidShift& first) {
  Flown f(Flown::Until::aligned);
  f.closures = 1;
  f.frame_W = first;
  for (int n = 0; n < 60; ++n) f.step();
  f.in.request = Request::enable;
  f.step();
  f.in.autopilot.offboard = f.in.autopilot.armed = true;
  for (int n = 0; n < 100; ++n) f.step();
  EXPECT_EQ(f.out.supervisor.mode, Mode::tracking) << to_string(f.out.supervisor.reason);
  return f;
}

// In one tick: a loop closure, and a hold that has no stop to rest on.
TEST(TickReactions, AHoldInTheTickOfALoopClosureIsWhereItPhysicallyWas) {
  const RigidShift first{0.1, {1, -1, 0.2}};
  Flown f = after_a_closure(first);
  const Setpoint local = f.out.command_local;
  f.closures = 2;
  f.frame_W = RigidShift{0.13, {1.3, -1.2, 0.25}};
  f.in.surroundings.outside = true;
  f.step();
  ASSERT_EQ(f.out.supervisor.mode, Mode::hold);
  EXPECT_LT((f.out.command_local.p_W - local.p_W).norm(), 1e-6);
}

}  // namespace
}  // namespace backwash::track::test
