// SPDX-License-Identifier: BSD-3-Clause
// Rows 21 to 25 of docs/faults.md in lockstep: the controller and the pilot.
#include <gtest/gtest.h>

#include "tests/daemon/lockstep/heartbeats.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

TEST(ControllerSilenceFault, WithoutAHeartbeatOfTheControllerItIsQuietAfterOneAndAHalfSeconds) {
  InFlight rig;
  rig.autopilot->mute = true;
  rig.say(heartbeat(true, kOffboard));
  rig.tick();
  EXPECT_EQ(rig.ticks_until(Mode::quiet, 100), 76);  // the first tick later than 75 periods
  EXPECT_EQ(rig.reason(), Reason::autopilot_silent);
  for (int n = 0; n < 100; ++n) EXPECT_TRUE(rig.tick().silent());
}

TEST(OffboardLeftFault, WhenTheControllerLeavesOffboardItStopsInTheSameTickAndNeverAsksAgain) {
  InFlight rig;
  rig.in_hand().take_over();
  EXPECT_TRUE(rig.tick().silent());
  EXPECT_EQ(rig.mode(), Mode::passive);
  EXPECT_EQ(rig.reason(), Reason::offboard_left);
  EXPECT_EQ(rig.view().segment, 0u) << "the trajectory is dropped";
  // The vehicle is armed and somebody else's: nothing but what its estimator flies by.
  for (int n = 0; n < 500; ++n) {
    EXPECT_TRUE(rig.tick().silent());
    EXPECT_EQ(rig.wire().odometry, 1);
  }
}

// He acts between our enable and the autopilot's first heartbeat that says that it follows: our request must not undo
// it.
TEST(OffboardLeftFault, APilotWhoChangesTheModeWhileWeEnableIsNotOverridden) {
  constexpr std::uint32_t kManual = 1u << 16, kPosition = 3u << 16;
  Lockstep rig;
  rig.ticks(60);
  rig.autopilot->mute = true;
  rig.say(heartbeat(false, kPosition));  // his change of before is none of ours
  rig.tick();
  EXPECT_TRUE(rig.channels->orders.push({track::Request::enable}));
  rig.tick();
  ASSERT_EQ(rig.mode(), Mode::enabling) << to_string(rig.reason());
  rig.ticks(3);
  rig.say(heartbeat(false, kPosition));
  rig.ticks(2);
  ASSERT_EQ(rig.mode(), Mode::enabling) << "the same mode again is no change";
  rig.say(heartbeat(true, kManual));
  rig.tick();
  EXPECT_EQ(rig.mode(), Mode::passive) << to_string(rig.reason());
  for (int n = 0; n < 60; ++n) EXPECT_TRUE(rig.tick().silent()) << n;
}

TEST(OtherHandsFault, APilotOrAFailsafeIsNeverFoughtInAnyMode) {
  for (const Mode from : {Mode::tracking, Mode::hold, Mode::land}) {
    InFlight rig;
    if (from == Mode::hold) {
      rig.tick(3);
    } else if (from == Mode::land) {
      EXPECT_TRUE(rig.channels->orders.push({track::Request::land}));
      rig.tick();
    }
    ASSERT_EQ(rig.mode(), from);
    rig.autopilot->mute = true;
    for (int n = 0; n < 250; ++n) {
      if (n % 50 == 0) rig.say(heartbeat(true, kReturn));
      const Wire& wire = rig.tick();
      EXPECT_TRUE(wire.setpoints.empty());
      EXPECT_FALSE(wire.commanded(kCommandMode) || wire.commanded(kCommandLand) || wire.commanded(kCommandArm));
    }
  }
}

TEST(DisarmingFault, DisarmedDropsTheTrajectoryAndNeedsANewEnable) {
  InFlight rig;
  rig.in_hand().disarm();
  rig.tick();
  EXPECT_EQ(rig.mode(), Mode::passive);
  EXPECT_EQ(rig.reason(), Reason::disarmed);
  EXPECT_EQ(rig.view().segment, 0u);
  for (int n = 0; n < 100; ++n) EXPECT_TRUE(rig.tick().setpoints.empty());
  EXPECT_TRUE(rig.channels->orders.push({track::Request::enable}));
  ASSERT_GT(rig.ticks_until(Mode::tracking, 250), 0) << to_string(rig.reason());
  // Enabled anew it holds where it is; the old trajectory is not resumed.
  const Vec3 here = rig.autopilot->truth().p_W;
  for (int n = 0; n < 50; ++n) EXPECT_LT((rig.in_map(rig.tick().setpoints.at(0)).p_W - here).norm(), 0.1);
}

TEST(LowBatteryFault, ALowBatteryAsksToLandOnce) {
  InFlight rig;
  rig.autopilot->battery = 0.5;
  rig.ticks(60);
  EXPECT_EQ(rig.mode(), Mode::tracking);
  ASSERT_TRUE(rig.view().battery);
  EXPECT_DOUBLE_EQ(rig.view().battery->value.remaining.value(), 0.5);
  rig.autopilot->battery = 0.14;
  ASSERT_GT(rig.ticks_until(Mode::land, 51), 0);
  EXPECT_EQ(rig.reason(), Reason::battery_low);
  int asked = rig.wire().commanded(kCommandLand);
  while (rig.mode() == Mode::land) {
    EXPECT_TRUE(rig.wire().setpoints.empty());
    asked += rig.tick().commanded(kCommandLand);
    ASSERT_LT(asked, 3);
  }
  EXPECT_GE(asked, 1);
  EXPECT_EQ(rig.reason(), Reason::landed);
  // An operator who takes control again with the same battery is not landed a second time.
  EXPECT_TRUE(rig.channels->orders.push({track::Request::enable}));
  ASSERT_GT(rig.ticks_until(Mode::tracking, 250), 0) << to_string(rig.reason());
  rig.ticks(200);
  EXPECT_EQ(rig.mode(), Mode::tracking);
}

// Rows 32, 33, 35 and 36 of docs/faults.md in lockstep: the daemon's own clock, memory, disk and restart; how it holds
// and what it tells.

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
