// SPDX-License-Identifier: BSD-3-Clause
// Rows 32, 33, 35 and 36 of docs/faults.md in lockstep: the daemon's own clock, memory, disk and restart; how it holds
// and what it tells.
#include <gtest/gtest.h>

#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

std::vector<ControlEvent> events(Lockstep& rig) {
  std::vector<ControlEvent> all;
  while (const auto event = rig.channels->events.pop()) all.push_back(*event);
  return all;
}

TEST(MissedDeadlineFault, OneMissedDeadlineIsLoggedThreeInASecondHoldTwentyFiveInARowAreQuiet) {
  const auto missed_events = [](Lockstep& rig) {
    std::uint64_t periods = 0;
    for (const auto& e : events(rig)) periods += e.kind == ControlEvent::Kind::missed_deadline ? e.count : 0;
    return periods;
  };
  {
    InFlight rig(0.5);
    events(rig);
    for (int n = 0; n < 6; ++n) {  // a third of a second apart at least: never three within one
      rig.tick(1);
      rig.ticks(26);
    }
    EXPECT_EQ(rig.mode(), Mode::tracking);
    EXPECT_EQ(missed_events(rig), 6u);
    EXPECT_EQ(rig.view().shown.ticks_missed, 6u);
  }
  {
    InFlight rig;
    rig.tick(1);
    rig.ticks(10);
    rig.tick(1);
    rig.ticks(10);
    EXPECT_EQ(rig.mode(), Mode::tracking);
    rig.tick(1);
    EXPECT_EQ(rig.mode(), Mode::hold);
    EXPECT_EQ(rig.reason(), Reason::deadline_missed);
  }
  {
    InFlight rig;
    rig.tick(25);
    EXPECT_EQ(rig.mode(), Mode::quiet);
    EXPECT_EQ(rig.reason(), Reason::clock_stopped);
    EXPECT_TRUE(rig.wire().silent());
  }
}

// With a trusted pose HOLD is reached on the next verified stop of the trajectory, not by a step to zero velocity.
TEST(Hold, WithATrustedPoseRestsOnTheVerifiedStopWithinTheLimits) {
  InFlight rig;
  const double speed = rig.in_map(rig.wire().setpoints.at(0)).v_W.norm();
  EXPECT_GT(speed, 0.5);
  rig.say(mavlink::Odometry{.q = {1, 0, 0, 0}, .reset_counter = 1});
  rig.tick();
  rig.say(mavlink::Odometry{.q = {1, 0, 0, 0}, .reset_counter = 2});
  rig.tick();
  ASSERT_EQ(rig.mode(), Mode::hold);
  Setpoint last = rig.in_map(rig.wire().setpoints.at(0));
  const Vec3 from = last.p_W;
  int moving = 0;
  for (int n = 0; n < 150; ++n) {
    const Setpoint now = rig.in_map(rig.tick().setpoints.at(0));
    EXPECT_LE((now.v_W - last.v_W).cwiseAbs().maxCoeff() / kControlPeriod, 4.1);
    EXPECT_LT((now.p_W - last.p_W).norm(), 0.04);
    moving += now.v_W.norm() > 1e-6;
    last = now;
  }
  EXPECT_EQ(last.v_W, Vec3::Zero());
  EXPECT_LT(moving, 100);
  EXPECT_LT((last.p_W - from).norm(), 1.6);
  EXPECT_EQ(rig.view().shown.samples_outside, 0u) << "braking left its verified sets";
  EXPECT_LT((rig.autopilot->truth().p_W - last.p_W).norm(), 0.15);
}

TEST(PageFault, APageFaultInATickIsAnEvent) {
  Lockstep rig;
  rig.ticks(20);
  events(rig);
  const std::uint64_t before = rig.view().shown.page_faults;
  rig.ticks(20);
  EXPECT_EQ(events(rig).empty(), rig.view().shown.page_faults == before)
      << "the machine may take a page of its own accord";
  rig.forget_pages();
  rig.tick();
  rig.tick();
  const auto seen = events(rig);
  ASSERT_FALSE(seen.empty());
  EXPECT_EQ(seen[0].kind, ControlEvent::Kind::page_fault);
  EXPECT_GT(seen[0].count, 0u);
}

TEST(UntakenRecordsFault, WhenNobodyTakesTheRecordsTheFlightIsUnaffectedAndTheLossIsCounted) {
  InFlight rig(0.2);
  rig.recorded = false;
  for (int n = 0; n < 300; ++n) EXPECT_EQ(rig.tick().setpoints.size(), 1u);
  EXPECT_EQ(rig.mode(), Mode::tracking);
  EXPECT_GT(rig.channels->control_log.lost(), 100u);
}

TEST(RestartFault, ADaemonThatRestartsInFlightSendsNothingToTheArmedVehicleAndStaysPassive) {
  InFlight rig;
  rig.restart();
  int armed = 0, forwarded = 0;
  for (int n = 0; n < 250 && rig.autopilot->armed(); ++n, ++armed) {
    EXPECT_TRUE(rig.tick().silent());
    forwarded += rig.wire().odometry;
    EXPECT_EQ(rig.mode(), Mode::passive);
  }
  EXPECT_GT(armed, 60) << "the vehicle was not in the air";
  EXPECT_GE(forwarded, armed - 50) << "its estimator flies by our odometry, from its first heartbeat on";
  for (int n = 0; n < 100; ++n) EXPECT_TRUE(rig.tick().setpoints.empty());
  EXPECT_EQ(rig.mode(), Mode::passive);
}

TEST(Operator, HearsTheReasonOfEveryTransitionOnTheLinkAndInTheEvents) {
  Lockstep rig;
  rig.take_off();
  rig.start_route(1);
  events(rig);
  rig.tick(3);
  ASSERT_EQ(rig.mode(), Mode::hold);
  ASSERT_EQ(rig.wire().texts.size(), 1u);
  EXPECT_EQ(rig.wire().texts[0], to_string(Reason::deadline_missed));
  auto seen = events(rig);
  std::erase_if(seen, [](const auto& e) { return e.kind == ControlEvent::Kind::page_fault; });  // memory is not locked
  ASSERT_EQ(seen.size(), 2u);
  EXPECT_EQ(seen[0].kind, ControlEvent::Kind::transition);
  EXPECT_EQ(seen[0].mode, Mode::hold);
  EXPECT_EQ(seen[0].reason, Reason::deadline_missed);
}

}  // namespace
}  // namespace backwash::daemon::test
