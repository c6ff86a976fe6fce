// SPDX-License-Identifier: BSD-3-Clause
// What the mission refuses, why it says so, and that nothing follows from it.
#include <functional>
#include <limits>

#include "tests/daemon/plan/mission_rig.hpp"

namespace backwash::daemon::test {
namespace {

class MissionRefusals : public MissionTest {
 protected:
  void expect_nothing(const Decision& d, std::uint8_t result, const std::string& why) {
    ASSERT_TRUE(d.answer);
    EXPECT_EQ(d.answer->result, result) << why;
    EXPECT_NE(d.answer->reason.find(why), std::string::npos) << d.answer->reason;
    EXPECT_FALSE(d.job || d.order) << why;
  }
  CommandMessage route(std::size_t count) {
    CommandMessage follow = gcs_.next(kFollow);
    follow.waypoints = count;
    for (auto& p : follow.waypoint) p = {1, 0, 1.2};
    return follow;
  }
};

TEST_F(MissionRefusals, NothingIsEnabledWhereSomethingIsMissingAndTheReasonIsTold) {
  view_.mode = Mode::passive;
  view_.armed = view_.offboard = false;
  view_.landed = true;
  const ControlView whole = view_;
  const struct {
    std::function<void()> fault;
    const char* why;
  } faults[] = {
      {[&] { view_.mismatch = Mismatch::yaw; }, "map and autopilot disagree"},
      {[&] { view_.odometry_age = 0.2; }, "no odometry"},
      {[&] { view_.heartbeat_age = 2; }, "no heartbeat"},
      {[&] { view_.pose_age = 0.32; }, "no pose from the autopilot"},
      {[&] { view_.autopilot = &firmware_bridge::kArduPilot; }, "no value of GUID_TIMEOUT from the autopilot yet"},
      {[&] { view_.state.p_W.x() = 99; }, "outside the map"}};
  for (const auto& [fault, why] : faults) {
    view_ = whole;
    fault();
    look();
    expect_nothing(give(gcs_.next(kEnable)), kRefused, why);
  }
  view_ = whole;
  look();
  Mission blind{Vehicle{}};
  MissionInput in;
  in.now_s = now_s_;
  in.view = whole;
  blind.observe(in);
  expect_nothing(blind.handle(Station{7, 77}.next(kEnable), now_s_), kRefused, "no map");
  ASSERT_TRUE(mission_.handle(gcs_.next(kStop), now_s_).order);  // not yet taken
  expect_nothing(mission_.handle(gcs_.next(kEnable), now_s_), kRefused, "last order");
  view_.epoch.order = 1;
  look();
  EXPECT_EQ(result(give(gcs_.next(kEnable))), kAccepted);
}

// Both would take control at one command. One that flies already goes on: it is in control.
TEST_F(MissionRefusals, NothingIsEnabledWhileAnotherDaemonObeysTheSameCommands) {
  const auto tell = [&](const char* who) {
    MissionInput in;
    in.now_s = now_s_;
    in.other_daemon.emplace();
    std::snprintf(in.other_daemon->data(), in.other_daemon->size(), "%s", who);
    mission_.observe(in);
  };
  tell("another daemon in this namespace, writer 01");
  EXPECT_EQ(result(give(gcs_.next(kGoto))), kAccepted);
  EXPECT_EQ(result(give(gcs_.next(kStop))), kAccepted);
  view_.mode = Mode::passive;
  view_.armed = view_.offboard = false;
  view_.landed = true;
  look();
  expect_nothing(give(gcs_.next(kEnable)), kRefused, "another daemon in this namespace, writer 01");
  tell("");
  EXPECT_EQ(result(give(gcs_.next(kEnable))), kAccepted);
}

TEST_F(MissionRefusals, NothingIsEnabledWhileTheOdometryIsDoubted) {
  const auto tell = [&](const char* doubt) {
    MissionInput in;
    in.now_s = now_s_;
    in.odometry_doubt.emplace();
    std::snprintf(in.odometry_doubt->data(), in.odometry_doubt->size(), "%s", doubt);
    mission_.observe(in);
  };
  view_.mode = Mode::passive;
  view_.armed = view_.offboard = false;
  view_.landed = true;
  look();
  tell("the twist is all zero");
  expect_nothing(give(gcs_.next(kEnable)), kRefused, "the twist is all zero");
  tell("");
  EXPECT_EQ(result(give(gcs_.next(kEnable))), kAccepted);
}

// A station changed it after `enable`, and the autopilot has told so. What stops or lands is never refused for it.
TEST_F(MissionRefusals, NoFlightBeginsOnAParameterThatHasBecomeUnsafe) {
  view_.autopilot = &firmware_bridge::kArduPilot;
  look();
  EXPECT_EQ(result(give(gcs_.next(kGoto))), kAccepted) << "what is not known was judged by enable";
  EXPECT_EQ(result(give(gcs_.next(kStop))), kAccepted);
  view_.parameters[0].value = 3;  // GUID_TIMEOUT
  look();
  expect_nothing(give(gcs_.next(kGoto)), kRefused, "GUID_TIMEOUT is 3");
  expect_nothing(give(route(2)), kRefused, "GUID_TIMEOUT is 3");
  EXPECT_TRUE(give(gcs_.next(kHold)).job);
  EXPECT_EQ(result(give(gcs_.next(kStop))), kAccepted);
  EXPECT_EQ(result(give(gcs_.next(kLand))), kAccepted);
  view_.landed = true;
  look();
  expect_nothing(give(gcs_.next(kTakeoff)), kRefused, "GUID_TIMEOUT is 3");
  view_.parameters[0].value = 0.3;
  look();
  EXPECT_TRUE(give(gcs_.next(kTakeoff)).job);
}

TEST_F(MissionRefusals, ACommandWithoutANameOrWithANumberThatIsNoneIsInvalidAndTakesNoLease) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  const std::function<void(CommandMessage&)> faults[] = {
      [](CommandMessage& c) { c.station = {}; }, [=](CommandMessage& c) { c.position.x() = nan; },
      [=](CommandMessage& c) { c.position.z() = -infinity; }, [=](CommandMessage& c) { c.yaw = nan; },
      [=](CommandMessage& c) { c.yaw = infinity; }};
  for (const auto& fault : faults)
    for (const std::uint8_t verb : {kGoto, kTakeoff, std::uint8_t{backwash_msgs_msg_dds__COMMAND_GOTO_FACING}}) {
      CommandMessage c = gcs_.next(verb);
      fault(c);
      expect_nothing(give(c), kInvalid, "finite numbers");
      EXPECT_EQ(mission_.station(now_s_), "");
    }
}

TEST_F(MissionRefusals, ARouteOfNoneOrTooManyOrBrokenWaypointsIsInvalid) {
  constexpr std::size_t kMost = CommandMessage::kMostWaypoints;
  expect_nothing(give(route(0)), kInvalid, "waypoints");
  expect_nothing(give(route(kMost + 1)), kInvalid, "waypoints");
  for (const std::size_t where : {std::size_t{0}, std::size_t{2}}) {
    CommandMessage broken = route(3);
    broken.waypoint[where][1] = std::numeric_limits<double>::infinity();
    expect_nothing(give(broken), kInvalid, "not finite");
  }
  EXPECT_EQ(result(give(route(kMost))), kAccepted);
}

TEST_F(MissionRefusals, ATakeOffNeedsTrackingAndAFlightNeedsTheAir) {
  view_.landed = true;
  for (const Mode mode : {Mode::passive, Mode::enabling, Mode::hold, Mode::land, Mode::quiet}) {
    view_.mode = mode;
    look();
    expect_nothing(give(gcs_.next(kTakeoff)), kRefused, "not enabled");
  }
  view_.mode = Mode::tracking;
  look();
  expect_nothing(give(gcs_.next(kGoto)), kRefused, "take off first");
  view_.landed.reset();
  look();
  expect_nothing(give(gcs_.next(kTakeoff)), kRefused, "does not say");
  expect_nothing(give(gcs_.next(kGoto)), kRefused, "does not say");
  view_.landed = true;
  look();
  EXPECT_TRUE(give(gcs_.next(kTakeoff)).job);
}

TEST_F(MissionRefusals, ASecondFlightWaitsUntilTheFirstIsPlanned) {
  const Decision first = give(gcs_.next(kGoto));
  ASSERT_TRUE(first.job);
  expect_nothing(give(gcs_.next(kGoto)), kRefused, "still planning");
  const PlanOutcome failed{first.job->id, false, {"no way"}};
  look({&failed, 1});
  EXPECT_TRUE(give(gcs_.next(kGoto)).job);
}

TEST_F(MissionRefusals, ARepeatedCommandIsRefusedAgainForTheSameReason) {
  view_.finished = false;
  look();
  expect_nothing(give(gcs_.next(kGoto)), kRefused, "flying");
  view_.finished = true;
  look();
  expect_nothing(give(gcs_.at(gcs_.sequence, kGoto)), kRefused, "flying");
}

TEST_F(MissionRefusals, AWayThatWasBlockedIsTriedAgainFromRestOnly) {
  const Decision go = give(gcs_.next(kGoto));
  const PlanOutcome done{go.job->id, true, {}};
  view_.finished = false;
  look({&done, 1});
  now_s_ += 5;
  view_.finished = true;
  view_.mode = Mode::hold;
  view_.reason = Reason::obstacle_ahead;
  view_.state.v_W = {0.5, 0, 0};
  EXPECT_FALSE(look().job);
  view_.state.v_W.setZero();
  EXPECT_TRUE(look().job);
}

TEST_F(MissionRefusals, OrdersAboutTheAirWhereNothingIsLearntOfIt) {
  for (const auto verb : {kAirReset, kAirFreeze, kAirThaw}) {
    const Decision d = give(gcs_.next(verb));
    expect_nothing(d, kRefused, "adaptation.enabled is false");
    EXPECT_FALSE(d.air);
  }
}

TEST_F(MissionRefusals, AResetOfTheAirThatWouldShrinkSetsThatMayBeFlown) {
  view_.air.emplace();
  const auto reset = [&](Mode mode, bool armed) {
    view_.mode = mode;
    view_.armed = armed;
    look();
    return give(gcs_.next(kAirReset));
  };
  for (const Mode mode : {Mode::passive, Mode::quiet, Mode::enabling, Mode::tracking, Mode::hold, Mode::land}) {
    const Decision d = reset(mode, true);
    expect_nothing(d, kRefused, "the vehicle is armed: land first");
    EXPECT_FALSE(d.air);
  }
  for (const Mode mode : {Mode::enabling, Mode::tracking, Mode::lifting, Mode::hold}) {
    const Decision d = reset(mode, false);
    expect_nothing(d, kRefused, "enabled: disable first");
    EXPECT_FALSE(d.air);
  }
  for (const Mode mode : {Mode::passive, Mode::quiet}) EXPECT_EQ(reset(mode, false).air, adapt::AirOrder::reset);
}

TEST_F(MissionRefusals, OrdersAboutTheAirOfAnotherStationOrARepeat) {
  view_.air.emplace();
  look();
  const Decision first = give(gcs_.next(kAirFreeze));
  EXPECT_EQ(result(first), kAccepted);
  EXPECT_EQ(first.air, adapt::AirOrder::freeze);
  EXPECT_FALSE(first.order || first.job) << "what flies goes on";
  EXPECT_EQ(mission_.accepted().sequence, 0u) << "whoever waits for a flight waits on";
  const Decision again = give(gcs_.at(gcs_.sequence, kAirFreeze));
  EXPECT_EQ(result(again), kAccepted);
  EXPECT_FALSE(again.air) << "answered again, not done again";
  const Decision others = give(other_.next(kAirThaw));
  expect_nothing(others, kNotYours, "session held");
  EXPECT_FALSE(others.air);
  EXPECT_EQ(give(gcs_.next(kAirThaw)).air, adapt::AirOrder::thaw);
}

}  // namespace
}  // namespace backwash::daemon::test
