// SPDX-License-Identifier: BSD-3-Clause
// Events that fall together: an order in the tick of a fault, a switch pressed where the vehicle already holds, poses
// that are told again, a pilot who takes over before we have, loop closures in a row.
#include <gtest/gtest.h>

#include "core/track/orders.hpp"
#include "core/track/supervisor.hpp"
#include "core/types/angle.hpp"
#include "tests/track/flown/flown.hpp"
#include "tests/track/flown/healthy.hpp"
#include "tests/track/flown/straight_flight.hpp"

namespace backwash::track::test {
namespace {

// Rows 3 and 39: a sample that jumps is forgotten while nothing is commanded, and with it the place to hold.
TEST(Enabling, IsRefusedInTheTickInWhichThePoseIsForgotten) {
  const std::function<void(OdometrySample&)> jumps[] = {[](OdometrySample& s) {
                                                          s.state.v_W = {2, 0, 0};
                                                        },
                                                        [](OdometrySample& s) { s.state.p_W.x() += 0.12; },
                                                        [](OdometrySample& s) { s.q = Flown::quaternion(0.2); }};
  for (const auto& jump : jumps) {
    Flown f(Flown::Until::aligned);
    f.spoil = jump;
    f.in.request = Request::enable;
    f.step();
    f.spoil = {};
    EXPECT_EQ(f.out.supervisor.mode, Mode::passive);
    EXPECT_EQ(f.out.supervisor.reason, Reason::odometry_lost);
    f.step();
    f.in.request = Request::enable;
    f.step();
    EXPECT_EQ(f.out.supervisor.mode, Mode::enabling) << to_string(f.out.supervisor.reason);
    EXPECT_LT((f.out.command.p_W - Vec3(0, 0, 1)).norm(), 0.15) << "set-points of the present place";
  }
}

// Row 37: it is one more operator, whose STOP has no number.
TEST(StopOfTheSwitch, EndsAPlanUnderWayAlsoWhereTheVehicleHoldsForAStopAlready) {
  Flown f;
  f.in.request = Request::stop;
  f.in.order = 5;
  f.step();
  f.in.order = 0;
  for (int n = 0; n < 200; ++n) f.step();
  ASSERT_EQ(f.out.supervisor.reason, Reason::stop_requested);
  ASSERT_TRUE(f.tick.tracker().finished());
  AcceptedSegment planned = segment_of(std::vector<Setpoint>(100, f.out.command));
  planned.id = 77;
  planned.epoch = f.tick.epoch();
  f.in.request = Request::stop;  // pressed and released while it is planned
  f.step();
  f.in.segment = &planned;
  f.step();
  EXPECT_TRUE(f.out.refused);
  EXPECT_EQ(f.out.supervisor.mode, Mode::hold);
  f.offer(planned);
  EXPECT_TRUE(f.out.accepted) << "what is planned later flies";
}

/// What an autopilot at half the rate tells again in between, its stamp by now a little earlier in our clock.
enum class Again { nothing, position, both };
/// Ticks until the frames are no longer trusted, of an autopilot that follows the VIO in yaw while that turns by 6°/s
/// and its gyros say nothing.
int ticks_trusted(Again again) {
  Flown f(Flown::Until::tracking);
  std::int64_t last_ns = 0;
  double yaw = 0;
  int n = 0;
  for (; n < 300 && f.out.supervisor.mode == Mode::tracking; ++n) {
    f.in.now_ns += 20'000'000;
    yaw += 0.1 * 0.02;
    f.in.odometry->received_ns = f.in.odometry->stamp_ns = f.in.now_ns;
    f.in.odometry->state.p_W.x() += n % 2 == 0 ? 1e-6 : -1e-6;
    f.in.odometry->q = Flown::quaternion(yaw);
    f.in.autopilot.pose->q = Flown::quaternion(Flown::kYaw + yaw);
    const std::int64_t told_ns = again != Again::nothing && n % 2 != 0 ? last_ns - 500'000 : f.in.now_ns;
    f.in.autopilot.pose->at_ns = last_ns = told_ns;
    f.in.autopilot.pose->attitude_at_ns = again == Again::both ? told_ns : f.in.now_ns;
    f.out = f.tick.step(f.in);
  }
  return n;
}

TEST(GyrosAgainstTheVio, AreNotSilencedByAPoseThatIsToldAgain) {
  const int plain = ticks_trusted(Again::nothing);
  EXPECT_LT(plain, 60);
  for (const Again again : {Again::position, Again::both}) EXPECT_LE(ticks_trusted(again), plain + 2);
}

// Rows 22 and 25: frames that did not agree yet keep the vehicle from being followed; meanwhile the pilot takes it.
TEST(Enabling, EndsWhenThePilotTakesTheVehicleOutOfOffboard) {
  Flown f(Flown::Until::aligned);
  f.in.request = Request::enable;
  f.in.autopilot.armed = true;
  f.local_off.z() = 0.12;
  for (int n = 0; n < 20; ++n) f.step();
  f.in.autopilot.offboard = true;
  for (int n = 0; n < 10; ++n) f.step();
  ASSERT_EQ(f.out.supervisor.mode, Mode::enabling);
  f.in.autopilot.offboard = false;
  f.local_off.z() = 0;
  for (int n = 0; n < 250; ++n) {
    EXPECT_FALSE(f.step().supervisor.request_offboard) << n;
    EXPECT_EQ(f.out.supervisor.mode, Mode::passive);
  }
}

// Row 4: an absurd one does not come in pieces.
TEST(LoopClosures, AddUpInFlightToWhatIsNotFlown) {
  for (const bool turns : {false, true}) {
    Flown f;
    f.closures = 1;  // the odometry came into the map by the first one
    f.step();
    for (std::uint32_t n = 1; n <= 3; ++n) {
      (turns ? f.frame_W.yaw : f.frame_W.t.x()) += turns ? 4 * kDegree : 0.45;
      ++f.closures;
      f.step();
      EXPECT_EQ(f.out.supervisor.mode, n < 3 ? Mode::tracking : Mode::hold) << n << to_string(f.out.supervisor.reason);
      for (int k = 0; k < 3; ++k) f.step();
    }
    EXPECT_EQ(f.out.supervisor.reason, Reason::closure_refused);
  }
}

TEST(LoopClosures, OfAnEarlierFlightDoNotCountInTheNextOne) {
  Flown f(Flown::Until::tracking);
  f.closures = 1;
  f.step();
  const auto moved = [&f] {
    f.frame_W.t.x() += 0.8;
    ++f.closures;
    f.step();
    return f.out.supervisor.mode;
  };
  ASSERT_EQ(moved(), Mode::tracking);
  f.in.autopilot.armed = f.in.autopilot.offboard = false;
  f.step();
  ASSERT_EQ(f.out.supervisor.mode, Mode::passive);
  f.in.request = Request::enable;
  f.step();
  f.in.autopilot.armed = f.in.autopilot.offboard = true;
  f.step();
  ASSERT_EQ(f.out.supervisor.mode, Mode::tracking) << to_string(f.out.supervisor.reason);
  EXPECT_EQ(moved(), Mode::tracking) << to_string(f.out.supervisor.reason);
}

// A segment that was taken although the pose is not trusted is not flown: neither whole nor to its first stop.
TEST(UntrustedHold, FliesNothingThatIsOfferedInIt) {
  Flown f;
  f.vio_on = false;
  for (int n = 0; f.out.supervisor.mode == Mode::tracking && n < 20; ++n) f.step();
  ASSERT_TRUE(f.out.supervisor.freeze) << to_string(f.out.supervisor.reason);
  const Vec3 held = f.out.command.p_W;
  AcceptedSegment on = straight();
  on.id = 2;
  on.tube.front().center = f.tick.odometry()->state;
  f.offer(on);
  for (int n = 0; f.out.supervisor.mode == Mode::hold && n < 30; ++n) EXPECT_EQ(f.step().command.p_W, held) << n;
  EXPECT_EQ(f.out.supervisor.mode, Mode::land);
}

// Row 40: of a vehicle that holds nobody asked for one, whatever the planner has offered.
TEST(Hold, TakesNoTakeOff) {
  Flown f = on_the_ground();
  f.in.autopilot.armed = true;  // by a pilot
  f.step();
  f.in.request = Request::stop;
  f.step();
  ASSERT_EQ(f.out.supervisor.mode, Mode::hold) << to_string(f.out.supervisor.reason);
  AcceptedSegment up = take_off();
  EXPECT_TRUE(f.offer(up).refused);
  EXPECT_EQ(f.out.supervisor.mode, Mode::hold);
}

// A sender whose clock is slewed: every sample would be late from then on.
TEST(LateOdometry, WhileNothingIsCommandedIsMeasuredAnew) {
  Flown f(Flown::Until::aligned);
  std::int64_t slewed_ns = 0;
  f.spoil = [&slewed_ns](auto& s) { s.stamp_ns -= slewed_ns += slewed_ns < 150'000'000 ? 2'000'000 : 0; };
  for (int n = 0; n < 100; ++n) f.step();
  EXPECT_LT(f.tick.odometry_age(), 0.08);
  f.in.request = Request::enable;
  EXPECT_EQ(f.step().supervisor.mode, Mode::enabling) << to_string(f.out.supervisor.reason);
}

// Row 6: at rest in the air a pose that repeats to the last bit is no sensor's; where nothing says that it flies it may
// be.
TEST(FrozenPose, IsFoundAtRestInTheAir) {
  for (const bool in_air : {true, false}) {
    Flown f(Flown::Until::tracking);
    f.shakes = false;
    if (in_air) f.in.autopilot.landed = false;
    for (int n = 0; n < 10 && f.out.supervisor.mode == Mode::tracking; ++n) f.step();
    EXPECT_EQ(f.out.supervisor.reason, in_air ? Reason::odometry_frozen : Reason::autopilot_follows);
  }
}

// At rest for an obstacle a later plan leads on; once something else holds it there, only a later command does (row
// 39).
TEST(HoldAtRest, ThatChangesItsReasonIsToldAndEndsWhatWasPlannedInIt) {
  Flown f;
  f.in.autopilot.reset_counter = 1;
  f.in.surroundings.tube_blocked = true;
  ASSERT_EQ(f.step().supervisor.reason, Reason::obstacle_ahead);
  f.in.surroundings.tube_blocked = false;
  for (int n = 0; n < 300; ++n) f.step();
  ASSERT_EQ(f.out.supervisor.mode, Mode::hold);
  const Setpoint rest = f.out.command;
  ASSERT_TRUE(rest.v_W.isZero(0));
  const Epoch before = f.tick.epoch();
  AcceptedSegment planned = segment_of(std::vector<Setpoint>(400, rest));
  planned.id = 2;
  planned.epoch = before;
  f.in.autopilot.reset_counter = 2;
  f.step();
  EXPECT_TRUE(f.out.supervisor.changed);
  EXPECT_EQ(f.out.supervisor.reason, Reason::autopilot_reset);
  EXPECT_EQ(f.tick.epoch().lapse, before.lapse + 1);
  f.in.segment = &planned;
  EXPECT_TRUE(f.step().refused);
  EXPECT_EQ(f.out.supervisor.mode, Mode::hold);
  EXPECT_LT((f.out.command.p_W - rest.p_W).norm(), 1e-9);
  EXPECT_TRUE(f.offer(planned).accepted) << "of a later command";
}

// After a fault in flight the autopilot gets no odometry, in whose hands it may be, until it is disarmed.
TEST(DistrustedOdometry, IsNotForwardedToAVehicleThatStillFlies) {
  Flown f;
  f.spoil = [](OdometrySample& s) { s.state.p_W.y() += 0.5; };
  for (int n = 0; n < 60; ++n) f.step();
  ASSERT_EQ(f.out.supervisor.mode, Mode::quiet);
  for (int n = 0; n < 100; ++n) EXPECT_FALSE(f.step().forward_odometry) << n;
  EXPECT_TRUE(f.out.fresh) << "it looks good";
  f.in.autopilot.armed = false;
  EXPECT_TRUE(f.step().forward_odometry);
}

}  // namespace
}  // namespace backwash::track::test

namespace backwash::track {
namespace {

Order next_of(std::initializer_list<Order> given) {
  Orders orders;
  for (const Order& order : given) orders.add(order);
  return orders.next();
}

TEST(Orders, TheOneThatEndsTheMotionIsNotDelayedByWhatCameWithIt) {
  for (const Request end : {Request::stop, Request::land}) {
    for (const Request other : {Request::enable, Request::disable, Request::hold}) {
      EXPECT_EQ(next_of({{other, 1}, {end, 2}}).request, end);
      EXPECT_EQ(next_of({{end, 1}, {other, 2}}).request, end);
    }
  }
  EXPECT_EQ(next_of({{Request::stop, 1}, {Request::land, 2}}).request, Request::land);
  EXPECT_EQ(next_of({{Request::land, 1}, {Request::stop, 2}}).request, Request::stop);
  EXPECT_EQ(next_of({{Request::hold, 1}, {Request::disable, 2}}).request, Request::disable);
}

TEST(Orders, TheNumberIsThatOfTheNewest) {
  EXPECT_EQ(next_of({{Request::stop, 3}, {Request::hold, 4}}).number, 4u);
  EXPECT_EQ(next_of({}).number, 0u);
  EXPECT_EQ(next_of({}).request, Request::none);
}

TEST(Orders, AnEnableBeforeAnEndIsGoneAndOneAfterItFollows) {
  Orders orders;
  orders.add({Request::enable, 1});
  orders.add({Request::stop, 2});
  EXPECT_EQ(orders.next().request, Request::stop);
  EXPECT_EQ(orders.next().request, Request::none);
  orders.add({Request::stop, 3});
  orders.add({Request::enable, 4});
  EXPECT_EQ(orders.next().request, Request::stop);
  const Order enable = orders.next();
  EXPECT_EQ(enable.request, Request::enable);
  EXPECT_EQ(enable.number, 4u);
  EXPECT_EQ(orders.next().request, Request::none);
}

// A daemon that died, or went quiet, in flight: the autopilot may hover in our mode for ever.
TEST(Orders, AnOperatorLandsAnArmedVehicleInOurModeThatNobodyCommands) {
  for (const Request request : {Request::land, Request::stop}) {
    for (const bool ours : {true, false}) {
      Supervisor s;
      SupervisorInput in = healthy();
      in.armed = true;
      in.offboard = ours;
      EXPECT_FALSE(s.step(in).send_heartbeat) << "it belongs to somebody else until an operator says so";
      in.request = request;
      auto out = s.step(in);
      in.request = Request::none;
      EXPECT_EQ(out.mode, ours ? Mode::land : Mode::passive);
      bool asked = false;
      for (int n = 0; n < 10; ++n) {
        asked = asked || out.request_land;
        out = s.step(in);
      }
      EXPECT_EQ(asked, ours);
    }
  }
}

}  // namespace
}  // namespace backwash::track
