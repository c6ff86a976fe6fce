// SPDX-License-Identifier: BSD-3-Clause
// The autopilot's parameters reach the view that enabling is decided from, and are read again when it may have
// restarted.
#include <gtest/gtest.h>

#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

std::string forbids(const Lockstep& rig) {
  return firmware_bridge::forbidding_parameter(*rig.view().autopilot, rig.view().parameters, vehicle_5in());
}

constexpr std::size_t kOfTheRig = 17;  // of PX4's rules, those whose parameter its emulation has

struct ParameterReading : testing::Test {
  Lockstep rig_;
  int commands_in(int ticks) {
    int n = 0;
    for (; ticks > 0; --ticks) n += static_cast<int>(rig_.tick().commands.size());
    return n;
  }
  std::size_t known() const {
    return static_cast<std::size_t>(
        std::ranges::count_if(rig_.view().parameters, [](const auto& answer) { return answer.value.has_value(); }));
  }
};

TEST_F(ParameterReading, AllAreKnownSoonAndThoseThatForbidComeFirst) {
  for (int n = 0; n < 60 && rig_.view().autopilot == &firmware_bridge::kUnknownAutopilot; ++n) rig_.tick();
  EXPECT_TRUE(forbids(rig_).starts_with("no value of COM_OF_LOSS_T")) << forbids(rig_);
  rig_.ticks(75);
  EXPECT_EQ(forbids(rig_), "");
  rig_.ticks(75);
  EXPECT_EQ(known(), kOfTheRig);
}

TEST_F(ParameterReading, AChangeByAStationIsSeenWhilePassive) {
  rig_.ticks(150);
  rig_.autopilot->parameters["COM_OF_LOSS_T"] = 5;
  rig_.ticks(15 * 50);
  EXPECT_TRUE(forbids(rig_).starts_with("COM_OF_LOSS_T is 5: set")) << forbids(rig_);
}

// It came back from a silence with other values: what it said before is not believed, and all is asked for anew.
TEST_F(ParameterReading, AnAutopilotThatRestartedIsAskedAnew) {
  rig_.ticks(150);
  rig_.autopilot->parameters["COM_OBL_RC_ACT"] = 3;
  rig_.autopilot->mute = true;
  rig_.ticks(100);
  rig_.autopilot->mute = false;
  rig_.ticks(75);
  EXPECT_EQ(forbids(rig_).substr(0, 19), "COM_OBL_RC_ACT is 3");
}

// An operator may ask to enable in the very tick in which it is heard again.
TEST_F(ParameterReading, NothingOfBeforeASilenceIsLeftInTheTickThatEndsIt) {
  constexpr std::size_t kObl = 1;  // COM_OBL_RC_ACT
  for (const int silent : {100, 103, 105}) {
    rig_.autopilot->parameters["COM_OBL_RC_ACT"] = 4;
    rig_.ticks(800);
    ASSERT_EQ(rig_.view().parameters[kObl].value, 4);
    rig_.autopilot->mute = true;
    rig_.ticks(silent);
    rig_.autopilot->parameters["COM_OBL_RC_ACT"] = 3;
    ASSERT_GT(rig_.view().heartbeat_age, track::Supervisor::kHeartbeatLost);
    rig_.autopilot->mute = false;
    for (int n = 0; n < 100 && rig_.view().heartbeat_age > track::Supervisor::kHeartbeatLost; ++n) rig_.tick();
    EXPECT_NE(rig_.view().parameters[kObl].value, 4) << silent;
    EXPECT_NE(forbids(rig_), "") << silent;
  }
}

// Not a byte more than odometry after QUIET, until an operator asks to enable.
TEST_F(ParameterReading, InQuietItIsAskedOnlyForAnOperatorWhoAsksToEnable) {
  rig_.ticks(150);
  rig_.take_off();
  rig_.autopilot->mute = true;
  ASSERT_GE(rig_.ticks_until(Mode::quiet, 200), 0);
  rig_.ticks(50);
  rig_.autopilot->mute = false;
  rig_.in_hand().disarm();
  EXPECT_EQ(commands_in(200), 0);
  ASSERT_EQ(rig_.mode(), Mode::quiet);
  EXPECT_TRUE(forbids(rig_).starts_with("no value of")) << forbids(rig_);
  rig_.channels->enable_asked_ns.store(rig_.now_ns());
  EXPECT_GT(commands_in(120), 0) << "messages and origin are asked for too: without a pose nobody enables";
  EXPECT_EQ(forbids(rig_), "");
}

// Who was killed in flight and started again says nothing to the vehicle, until an operator wants it in hand again.
// The clock of one that restarted is another: without it every pose of its counts as old, and enabling is refused.
TEST_F(ParameterReading, AfterARestartInTheAirTheClockIsAskedForTooByAnOperatorWhoAsksToEnable) {
  rig_.ticks(150);
  rig_.take_off();
  rig_.restart();
  rig_.ticks(55);
  const auto questions = [&](int ticks) {
    const std::size_t from = rig_.log.size();
    rig_.ticks(ticks);
    return std::count_if(rig_.log.begin() + static_cast<std::ptrdiff_t>(from), rig_.log.end(), [](const auto& r) {
      return r.header.kind == log::RecordKind::frame_out && (r.bytes[7] | r.bytes[8] << 8) == mavlink::Timesync::kId;
    });
  };
  EXPECT_EQ(questions(50), 0);
  rig_.channels->enable_asked_ns.store(rig_.now_ns());
  EXPECT_EQ(questions(50), 2);
}

TEST_F(ParameterReading, AfterARestartInTheAirItIsAskedForAnOperatorWhoAsksToEnable) {
  rig_.ticks(150);
  rig_.take_off();
  rig_.restart();
  rig_.ticks(55);  // the first heartbeat is among them
  ASSERT_TRUE(rig_.autopilot->armed());
  EXPECT_EQ(known(), 0U);
  rig_.channels->enable_asked_ns.store(rig_.now_ns());
  for (int n = 0; n < 75 && !forbids(rig_).empty(); ++n) rig_.tick();
  EXPECT_EQ(forbids(rig_), "");
  EXPECT_TRUE(rig_.autopilot->armed()) << "it was not in the air any more";
}

// It belongs to somebody else, whether we were started anew or are quiet, until an operator asks to enable.
TEST_F(ParameterReading, AnArmedVehicleIsAskedForNothing) {
  for (const bool restarted : {true, false}) {
    Lockstep rig;
    rig.ticks(150);
    rig.take_off();
    if (restarted) {
      rig.restart();
    } else {
      rig.autopilot->mute = true;
      ASSERT_GE(rig.ticks_until(Mode::quiet, 200), 0);
      rig.autopilot->mute = false;
    }
    rig.ticks(40);
    ASSERT_TRUE(rig.autopilot->armed());
    ASSERT_TRUE(rig.view().armed);
    EXPECT_TRUE(forbids(rig).starts_with("no value of")) << forbids(rig);
    for (const auto& answer : rig.view().parameters) EXPECT_FALSE(answer.value);
  }
}

TEST_F(ParameterReading, NothingIsAskedWhileTheLineIsNeeded) {
  rig_.ticks(150);
  rig_.take_off();
  rig_.autopilot->parameters["COM_OF_LOSS_T"] = 5;
  rig_.ticks(15 * 50);
  EXPECT_EQ(forbids(rig_), "");  // what counts is what it was enabled with
}

TEST_F(ParameterReading, OneThatItDoesNotKnowIsAskedForOnceASecondInTheEnd) {
  rig_.autopilot->parameters.erase("EKF2_HGT_REF");
  rig_.ticks(500);
  EXPECT_EQ(forbids(rig_), "");
  EXPECT_EQ(known() + 1, kOfTheRig);
}

}  // namespace
}  // namespace backwash::daemon::test
