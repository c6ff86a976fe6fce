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

}  // namespace
}  // namespace backwash::daemon::test
