// SPDX-License-Identifier: BSD-3-Clause
// What the tick makes of frames, resets and loop closures, with a vehicle that flies perfectly in a controller's frame
// that is turned and moved against the map.
#include <numbers>

#include "tests/track/flown/flown.hpp"

namespace backwash::track::test {
namespace {

TEST(TickReactions, TheAutopilotsOwnCountOfResetsIsEnough) {
  Flown f;
  f.in.autopilot.reset_counter = std::uint8_t{7};
  EXPECT_EQ(f.step().supervisor.mode, Mode::tracking);
  EXPECT_EQ(f.step().supervisor.mode, Mode::tracking);
  f.in.autopilot.reset_counter = std::uint8_t{8};
  EXPECT_EQ(f.step().supervisor.mode, Mode::hold);
  EXPECT_EQ(f.out.supervisor.reason, Reason::autopilot_reset);
}

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

TEST(TickReactions, AnAbsurdLoopClosureIsHeldAndNothingIsFlownAfterIt) {
  const RigidShift first{0.1, {1, -1, 0.2}};
  for (const bool turn : {false, true}) {
    Flown f = after_a_closure(first);
    const Setpoint before = f.out.command, local = f.out.command_local;
    RigidShift D{turn ? 0.2 : 0.0, {turn ? 0.0 : 1.2, 0, 0}};
    if (turn) D.t = before.p_W - D.rotate(before.p_W);  // about the vehicle: it stays where it is
    f.closures = 2;
    f.frame_W = D * first;
    f.step();
    EXPECT_EQ(f.out.supervisor.mode, Mode::hold);
    EXPECT_EQ(f.out.supervisor.reason, Reason::closure_refused);
    for (int n = 0; n < 50; ++n) {
      f.step();
      EXPECT_LT((f.out.command.p_W - before.p_W).norm(), 1e-9);
      EXPECT_LT((f.out.command_local.p_W - local.p_W).norm(), 1e-9);
    }
    AcceptedSegment on = straight();
    for (auto& c : on.commands) c = first.setpoint(c);
    for (auto& t : on.tube) t.center = first.state(t.center);
    on.closures = 1;
    EXPECT_TRUE(f.offer(on).refused);
  }
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
