// SPDX-License-Identifier: BSD-3-Clause
// That each promise of a Watch can be found broken, and is not where it is kept.
#include "tests/fuzz/sequence/watch.hpp"

#include <gtest/gtest.h>

#include "backwash_msgs.h"

namespace backwash::fuzz {
namespace {

constexpr double kStep = 0.02;  // m in a tick: 1 m/s

/// A daemon that flies along x after a go-to, armed and followed.
class Flight : public testing::Test {
 protected:
  Watch watch_{1.5};
  Seen seen_;

  void SetUp() override {
    seen_.mode = Mode::tracking;
    seen_.armed = seen_.offboard = true;
    seen_.bytes = 50;
    seen_.setpoints = 1;
    ask(backwash_msgs_msg_dds__COMMAND_ENABLE);
    rest(30);
    ask(backwash_msgs_msg_dds__COMMAND_GOTO);
    fly(30);
  }
  void ask(std::uint8_t verb) { watch_.acknowledged(verb, seen_.tick); }
  std::optional<std::string> tick(double step = 0) {
    ++seen_.tick;
    seen_.setpoint.x() += step;
    return watch_.check(seen_);
  }
  void fly(int ticks) {
    for (int n = 0; n < ticks; ++n) ASSERT_EQ(tick(kStep), std::nullopt);
  }
  void rest(int ticks) {
    for (int n = 0; n < ticks; ++n) ASSERT_EQ(tick(), std::nullopt);
  }
  void hold() { seen_.mode = Mode::hold; }
};

TEST_F(Flight, AStopMayBrakeAndThenRests) {
  ask(backwash_msgs_msg_dds__COMMAND_STOP);
  fly(2);
  hold();
  fly(60);
  rest(100);
  EXPECT_TRUE(tick(kStep)) << "it moves again";
}

TEST_F(Flight, AStopThatIsFlownOnIsFound) {
  ask(backwash_msgs_msg_dds__COMMAND_STOP);
  hold();
  fly(118);
  EXPECT_TRUE(tick(kStep));
}

TEST_F(Flight, TrackingAfterAStopIsFoundAtRestToo) {
  ask(backwash_msgs_msg_dds__COMMAND_STOP);
  rest(18);
  EXPECT_TRUE(tick());
}

TEST_F(Flight, EnablingAfterAStopIsFound) {
  seen_.mode = Mode::enabling;
  ask(backwash_msgs_msg_dds__COMMAND_STOP);
  rest(18);
  EXPECT_TRUE(tick());
}

TEST_F(Flight, ALaterCommandEndsTheStop) {
  ask(backwash_msgs_msg_dds__COMMAND_STOP);
  hold();
  rest(200);
  ask(backwash_msgs_msg_dds__COMMAND_GOTO);
  seen_.mode = Mode::tracking;
  fly(200);
}

TEST_F(Flight, AfterAHoldTheWayEndsAndNothingBeginsAnew) {
  ask(backwash_msgs_msg_dds__COMMAND_HOLD);
  fly(200);
  rest(25);
  EXPECT_TRUE(tick(kStep));
}

TEST_F(Flight, NothingMovesBetweenEnableAndTheFirstWay) {
  ask(backwash_msgs_msg_dds__COMMAND_ENABLE);
  EXPECT_TRUE(tick(kStep));
}

TEST_F(Flight, ASetpointAfterThePilotTookOverOrAfterLandIsFound) {
  seen_.offboard = false;
  seen_.mode = Mode::passive;
  EXPECT_TRUE(tick()) << "in passive";
  seen_.mode = Mode::tracking;
  for (int n = 0; n < 18; ++n) tick();
  EXPECT_TRUE(tick()) << "in any mode";
}

TEST_F(Flight, ASetpointOfTheLandModeIsFound) {
  ask(backwash_msgs_msg_dds__COMMAND_LAND);
  seen_.mode = Mode::land;
  EXPECT_TRUE(tick());
}

TEST_F(Flight, ALeapIsFoundAndANewFrameIsNone) {
  watch_.frame_moved(seen_.tick);
  ASSERT_FALSE(tick(5));
  rest(5);
  EXPECT_TRUE(tick(0.06));
}

TEST_F(Flight, AQuietThatSpeaksIsFound) {
  seen_.setpoints = 0;
  seen_.mode = Mode::quiet;
  ASSERT_FALSE(tick()) << "what was sent before the decision";
  EXPECT_TRUE(tick());
  seen_.bytes = 0;
  EXPECT_FALSE(tick());
}

TEST_F(Flight, APassiveThatCommandsAnArmedVehicleIsFound) {
  seen_.mode = Mode::passive;
  seen_.setpoints = 0;
  seen_.commands = 1;
  EXPECT_TRUE(tick());
  seen_.armed = false;
  EXPECT_FALSE(tick()) << "it asks a disarmed one for its messages";
}

TEST_F(Flight, ArmingIsForTheAcceptedTakeoffThatWasAskedForOnce) {
  seen_.arms = seen_.accepted = true;
  EXPECT_TRUE(tick()) << "a go-to";
  ask(backwash_msgs_msg_dds__COMMAND_TAKEOFF);
  EXPECT_FALSE(tick());
  EXPECT_TRUE(tick()) << "a second time";
  ask(backwash_msgs_msg_dds__COMMAND_TAKEOFF);
  seen_.accepted = false;
  EXPECT_TRUE(tick()) << "nothing was accepted";
  for (const auto cancel : {backwash_msgs_msg_dds__COMMAND_STOP, backwash_msgs_msg_dds__COMMAND_HOLD,
                            backwash_msgs_msg_dds__COMMAND_DISABLE, backwash_msgs_msg_dds__COMMAND_ENABLE}) {
    seen_.accepted = true;
    ask(backwash_msgs_msg_dds__COMMAND_TAKEOFF);
    ask(cancel);
    EXPECT_TRUE(tick()) << "cancelled by " << int{cancel};
  }
}

TEST_F(Flight, DisarmingIsForAStopOrADisable) {
  hold();
  seen_.disarms = true;
  EXPECT_TRUE(tick());
  ask(backwash_msgs_msg_dds__COMMAND_STOP);
  EXPECT_FALSE(tick());
  seen_.disarms = false;
  rest(170);
  seen_.disarms = true;
  EXPECT_TRUE(tick());
}

TEST_F(Flight, AStopSwitchEndsTheWayInItsTickAndForGood) {
  seen_.switched_off = true;
  EXPECT_TRUE(tick(kStep)) << "tracking";
  hold();
  fly(10);
  seen_.switched_off = false;
  fly(60);
  rest(60);
  EXPECT_TRUE(tick(kStep)) << "released is no command";
}

TEST_F(Flight, AStopSwitchCancelsTheTakeoff) {
  ask(backwash_msgs_msg_dds__COMMAND_TAKEOFF);
  hold();
  seen_.switched_off = true;
  ASSERT_FALSE(tick());
  seen_.switched_off = false;
  seen_.arms = seen_.accepted = true;
  EXPECT_TRUE(tick());
}

TEST_F(Flight, ASetpointOutsideTheMapIsFound) {
  seen_.inside = false;
  EXPECT_TRUE(tick(kStep));
}

}  // namespace
}  // namespace backwash::fuzz
