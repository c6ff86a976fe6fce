// SPDX-License-Identifier: BSD-3-Clause
// The mission's decisions: who may command, what is done once, and what an order ends (docs/faults.md rows 28, 39, 40,
// 48).
#include <thread>

#include "services/backwashd/channels.hpp"
#include "tests/daemon/plan/mission_rig.hpp"

namespace backwash::daemon::test {
namespace {

TEST_F(MissionTest, ARepeatedCommandIsAnsweredAgainAndNotDoneAgain) {
  const Decision first = give(gcs_.next(kGoto));
  ASSERT_EQ(result(first), kAccepted);
  ASSERT_TRUE(first.job);
  const Decision again = give(gcs_.at(gcs_.sequence, kGoto));
  EXPECT_EQ(result(again), kAccepted);
  EXPECT_FALSE(again.job || again.order);
  // Also where the state would now give another answer.
  const Decision land = give(gcs_.next(kLand));
  ASSERT_TRUE(land.order);
  view_.mode = Mode::passive;
  look();
  const Decision land_again = give(gcs_.at(gcs_.sequence, kLand));
  EXPECT_EQ(result(land_again), kAccepted);
  EXPECT_FALSE(land_again.order);
}

// Whoever waits for an older one can tell that it waits in vain.
TEST_F(MissionTest, TheNewestAcceptedCommandIsShownAndNoRefusedOneAndNoRelease) {
  const auto newest = [this] { return std::pair(mission_.accepted().session, mission_.accepted().sequence); };
  give(gcs_.next(kGoto));
  EXPECT_EQ(newest(), std::pair(gcs_.session, 1u));
  give(other_.next(kGoto));  // the other's session
  EXPECT_EQ(newest(), std::pair(gcs_.session, 1u));
  give(gcs_.next(kRelease));
  EXPECT_EQ(newest(), std::pair(gcs_.session, 1u));
  Station again{1, 12};
  give(again.next(kHold));
  EXPECT_EQ(newest(), std::pair(again.session, 1u));
  give(other_.next(kStop));  // everybody's
  EXPECT_EQ(newest(), std::pair(other_.session, other_.sequence));
}

TEST_F(MissionTest, AnOlderSequenceNumberIsInvalidAndDoesNothing) {
  give(gcs_.next(kGoto));
  give(gcs_.next(kStop));
  const Decision old = give(gcs_.at(1, kGoto));
  EXPECT_EQ(result(old), kInvalid);
  EXPECT_FALSE(old.job || old.order);
}

TEST_F(MissionTest, TheLeaseLastsTenSecondsFromTheHoldersLastCommand) {
  give(gcs_.next(kGoto));
  now_s_ += 9.9;
  EXPECT_EQ(result(give(other_.next(kLand))), kNotYours);
  EXPECT_NE(give(other_.next(kLand)).answer->reason.find("gcs"), std::string::npos);
  EXPECT_EQ(mission_.station(now_s_), "gcs");
  now_s_ += 0.2;
  EXPECT_EQ(mission_.station(now_s_), "");
  EXPECT_EQ(result(give(other_.next(kLand))), kAccepted);
  EXPECT_EQ(mission_.station(now_s_), "other");
}

// Row 48.
TEST_F(MissionTest, ASessionIsItsWritersAndNotItsNames) {
  give(gcs_.next(kHold));
  Station impostor{3, gcs_.session, gcs_.name, gcs_.sequence};
  EXPECT_EQ(result(give(impostor.next(kGoto))), kNotYours);
  Station namesake{4, 44, gcs_.name};
  EXPECT_EQ(result(give(namesake.next(kGoto))), kNotYours);
  EXPECT_EQ(result(give(gcs_.next(kHold))), kAccepted);
}

TEST_F(MissionTest, ADepartedWriterEndsItsSessionAtOnceAndNoOneElses) {
  give(gcs_.next(kHold));
  CommandMessage gone;
  gone.departed = true;
  gone.writer[0] = other_.writer;
  EXPECT_FALSE(give(gone).answer);
  EXPECT_EQ(mission_.station(now_s_), "gcs");
  gone.writer[0] = gcs_.writer;
  give(gone);
  EXPECT_EQ(mission_.station(now_s_), "");
  EXPECT_EQ(result(give(other_.next(kHold))), kAccepted);
}

TEST_F(MissionTest, ASessionThatIsOverNeverCountsAgain) {
  give(gcs_.next(kHold));
  give(gcs_.next(kRelease));
  for (const std::uint8_t writer : {std::uint8_t{1}, std::uint8_t{9}}) {
    Station replay{writer, gcs_.session, gcs_.name, 100};
    const Decision d = give(replay.next(kGoto));
    EXPECT_EQ(result(d), kInvalid);
    EXPECT_FALSE(d.job || d.order);
  }
  Station anew{1, 12, "gcs"};
  EXPECT_EQ(result(give(anew.next(kHold))), kAccepted);
}

TEST_F(MissionTest, AStopEndsTheRouteEvenIfTheVehicleRestsAtItsNextGoal) {
  CommandMessage follow = gcs_.next(kFollow);
  follow.waypoints = 2;
  follow.waypoint[0] = {1, 0, 1.2};
  follow.waypoint[1] = {-1, 0, 1.2};
  const Decision d = give(follow);
  ASSERT_TRUE(d.job);
  const PlanOutcome done{d.job->id, true, {}};
  view_.command.p_W = view_.state.p_W = {1, 0, 1.2};
  give(gcs_.next(kStop));
  now_s_ += 5;
  EXPECT_FALSE(look({&done, 1}).job);
}

TEST_F(MissionTest, ARouteGoesOnAtItsNextGoalAndAfterAnObstacleAndAfterNoOtherHold) {
  const auto begun = [&] {
    mission_ = Mission(Vehicle{});
    gcs_ = {1, gcs_.session + 1};
    SetUp();
    CommandMessage follow = gcs_.next(kFollow);
    follow.waypoints = 2;
    follow.waypoint[0] = {1, 0, 1.2};
    follow.waypoint[1] = {-1, 0, 1.2};
    const Decision d = give(follow);
    const PlanOutcome done{d.job->id, true, {}};
    view_.finished = false;
    look({&done, 1});
    now_s_ += 5;
    view_.finished = true;
  };
  begun();
  view_.command.p_W = view_.state.p_W = {1, 0, 1.2};
  const Decision on = look();
  ASSERT_TRUE(on.job);
  EXPECT_EQ(on.job->position, Vec3(-1, 0, 1.2));
  for (int r = 0; r < kReasons; ++r) {
    begun();
    view_.mode = Mode::hold;
    view_.reason = static_cast<Reason>(r);
    EXPECT_EQ(look().job.has_value(), view_.reason == Reason::obstacle_ahead) << to_string(view_.reason);
  }
}

TEST_F(MissionTest, WhatIsPlannedBelongsToTheLapseThatTheVehicleIsIn) {
  view_.epoch.lapse = 7;
  look();
  EXPECT_EQ(give(gcs_.next(kGoto)).job->epoch.lapse, 7u);
}

// Row 40, and STOP while enabling: what is shown may be a moment old, the order to enable still on its way.
TEST_F(MissionTest, AStopRightAfterAnEnableReachesTheControlThread) {
  view_.mode = Mode::passive;
  view_.armed = false;
  view_.landed = true;
  look();
  const Decision enabled = mission_.handle(gcs_.next(kEnable), now_s_);  // not yet taken
  ASSERT_TRUE(enabled.order);
  const Decision stopped = mission_.handle(gcs_.next(kStop), now_s_);
  EXPECT_EQ(result(stopped), kAccepted);
  ASSERT_TRUE(stopped.order);
  EXPECT_EQ(stopped.order->request, Request::stop);
  EXPECT_GT(stopped.order->number, enabled.order->number);
}

TEST_F(MissionTest, NothingIsPlannedWhileAnOrderIsOnItsWay) {
  ASSERT_TRUE(mission_.handle(gcs_.next(kStop), now_s_).order);  // not yet taken
  const Decision go = mission_.handle(gcs_.next(kGoto), now_s_);
  EXPECT_EQ(result(go), kRefused);
  EXPECT_FALSE(go.job);
}

// Until the rotors have spun up the vehicle still stands: a second take-off would begin again at the ground.
TEST_F(MissionTest, ATakeoffThatIsFlownIsNotBegunAgain) {
  view_.landed = true;
  look();
  const Decision rises = give(gcs_.next(kTakeoff));
  ASSERT_TRUE(rises.job);
  const PlanOutcome taken{rises.job->id, true, {}};
  view_.finished = false;
  look({&taken, 1});
  const Decision again = give(gcs_.next(kTakeoff));
  EXPECT_EQ(result(again), kRefused);
  EXPECT_FALSE(again.job);
}

// After a restart in the air, or out of QUIET, with the autopilot still in our mode: nobody else has it in hand.
TEST_F(MissionTest, NeitherLandNorStopIsRefusedToAnArmedVehicleInOurMode) {
  for (const Mode mode : {Mode::passive, Mode::quiet}) {
    for (const std::uint8_t verb : {kLand, kStop}) {
      view_.mode = mode;
      look();
      const Decision decision = give(gcs_.next(verb));
      EXPECT_EQ(result(decision), kAccepted) << int{verb};
      ASSERT_TRUE(decision.order);
      EXPECT_EQ(decision.order->request, verb == kLand ? track::Request::land : track::Request::stop);
      view_.epoch.order = decision.order->number;
    }
  }
}

TEST_F(MissionTest, RefusesWhatTheModeDoesNotAllow) {
  view_.mode = Mode::passive;
  view_.offboard = false;
  look();
  for (const std::uint8_t verb : {kTakeoff, kGoto, kHold, kLand, kStop})
    EXPECT_EQ(result(give(gcs_.next(verb))), kRefused) << int{verb};
  EXPECT_EQ(result(give(gcs_.next(99))), kInvalid);
  view_.mode = Mode::tracking;
  view_.offboard = true;
  look();
  EXPECT_EQ(result(give(gcs_.next(kTakeoff))), kRefused) << "already in the air";
  EXPECT_EQ(result(give(gcs_.next(kDisable))), kRefused) << "armed";
  EXPECT_EQ(result(give(gcs_.next(kEnable))), kRefused) << "already enabled";
  view_.finished = false;
  look();
  EXPECT_EQ(result(give(gcs_.next(kGoto))), kRefused) << "flying";
  view_.mode = Mode::enabling;
  look();
  EXPECT_EQ(result(give(gcs_.next(kDisable))), kAccepted) << "an armed vehicle that is being enabled";
}

TEST_F(MissionTest, AnOrderThatTheControlThreadDoesNotTakeIsNotAcknowledged) {
  Channels channels;
  channels.view_mission.write(view_);
  channels.worlds.offer({corridor()});
  while (channels.orders.push({})) {
  }
  EXPECT_TRUE(channels.commands.push(gcs_.next(kStop)));
  EXPECT_TRUE(channels.commands.push(gcs_.next(kHold)));
  std::vector<Answer> answers;
  Mission mission{Vehicle{}};
  std::thread thread([&] {
    run_mission(channels, mission, [&](const CommandMessage&, const Answer& a) {
      answers.push_back(a);
      if (answers.size() == 2) channels.stop = true;
    });
  });
  thread.join();
  ASSERT_EQ(answers.size(), 2u);
  for (const Answer& a : answers) EXPECT_EQ(a.result, kRefused) << a.reason;
  EXPECT_EQ(channels.jobs.take(), nullptr) << "a plan without its order";
}

}  // namespace
}  // namespace backwash::daemon::test
