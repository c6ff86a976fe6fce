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

// What a station may ask of a vehicle that lifts off: to end it, and nothing that would fly it on.

TEST_F(MissionTest, WhileItLiftsOffLandAndStopAreTakenAndEveryFlightIsRefused) {
  view_.mode = Mode::lifting;
  for (const std::uint8_t verb : {kTakeoff, kGoto, kHold, kEnable}) {
    look();
    const Decision refused = mission_.handle(gcs_.next(verb), now_s_);
    ASSERT_TRUE(refused.answer);
    EXPECT_EQ(refused.answer->result, kRefused) << int{verb};
    EXPECT_FALSE(refused.order || refused.job) << int{verb};
  }
  for (const auto& [verb, request] : {std::pair{kLand, Request::land}, std::pair{kStop, Request::stop}}) {
    const Decision taken = mission_.handle(gcs_.next(verb), now_s_);
    ASSERT_TRUE(taken.answer && taken.order) << int{verb};
    EXPECT_EQ(taken.answer->result, kAccepted) << int{verb};
    EXPECT_EQ(taken.order->request, request);
  }
}

// The line may have lost both commands, and the autopilot hovers: nobody else asks again.
TEST_F(MissionTest, WhileItLandsAnotherLandAndStopReachTheControlThread) {
  view_.mode = Mode::land;
  look();
  const Decision land = give(gcs_.next(kLand));
  ASSERT_TRUE(land.order) << land.answer->reason;
  EXPECT_EQ(land.order->request, Request::land);
  EXPECT_EQ(result(land), kAccepted);
  look();
  const Decision stop = give(other_.next(kStop));
  ASSERT_TRUE(stop.order);
  EXPECT_EQ(stop.order->request, Request::stop);
}

// STOP and what else ends a flight, as the mission takes it (docs/faults.md rows 39 and 48).

TEST_F(MissionTest, StopIsTakenFromEveryStationAndLeavesTheLeaseWhereItIs) {
  give(gcs_.next(kGoto));
  const Decision d = give(other_.next(kStop));
  EXPECT_EQ(result(d), kAccepted);
  ASSERT_TRUE(d.order);
  EXPECT_EQ(d.order->request, Request::stop);
  EXPECT_EQ(mission_.station(now_s_), "gcs");
  EXPECT_EQ(result(give(gcs_.next(kHold))), kAccepted);
}

TEST_F(MissionTest, AStopIsTakenWhateverIsWrongWithItsSessionItsNumberOrItsNumbers) {
  const auto stops = [&](const CommandMessage& c) {
    const Decision d = give(c);
    look();
    return result(d) == kAccepted && d.order && d.order->request == Request::stop;
  };
  // A number that has wrapped, one that is older, and the last command's.
  gcs_.sequence = 0xfffffffe;
  ASSERT_EQ(result(give(gcs_.next(kGoto))), kAccepted);
  EXPECT_TRUE(stops(gcs_.at(0, kStop)));
  EXPECT_TRUE(stops(gcs_.at(7, kStop)));
  EXPECT_TRUE(stops(gcs_.at(gcs_.sequence, kStop)));
  EXPECT_EQ(result(give(gcs_.at(0, kGoto))), kInvalid) << "nothing else comes that way";
  // No name, and numbers that a STOP has no use for.
  CommandMessage odd = gcs_.next(kStop);
  odd.station = {};
  EXPECT_TRUE(stops(odd));
  odd = gcs_.next(kStop);
  odd.yaw = NAN;
  EXPECT_TRUE(stops(odd));
  odd.position.x() = INFINITY;
  EXPECT_TRUE(stops(odd));
  // The lease ran out, another station took it: the first one's session is over, its operator's button is not.
  now_s_ += Mission::kLease + 1;
  ASSERT_EQ(result(give(other_.next(kGoto))), kAccepted);
  EXPECT_TRUE(stops(gcs_.next(kStop)));
  EXPECT_EQ(mission_.station(now_s_), "other");
  EXPECT_EQ(result(give(gcs_.next(kGoto))), kInvalid);
}

// Stations that give orders faster than the control thread ticks leave room for the one that counts.
TEST_F(MissionTest, AStopIsTakenHoweverManyOrdersWaitForTheControlThread) {
  std::size_t orders = 0;
  const auto without_tick = [&](std::uint8_t verb) {
    const Decision d = mission_.handle(gcs_.next(verb), now_s_);
    orders += d.order.has_value();
    return d;
  };
  for (int n = 0; n < 1000; ++n) without_tick(kHold);
  const Decision stop = mission_.handle(other_.next(kStop), now_s_);
  EXPECT_EQ(result(stop), kAccepted);
  ASSERT_TRUE(stop.order);
  EXPECT_EQ(stop.order->request, Request::stop);
  orders += 1;
  for (int n = 0; n < 1000; ++n)
    for (const std::uint8_t verb : {kLand, kHold, kStop}) without_tick(verb);
  EXPECT_EQ(result(mission_.handle(other_.next(kStop), now_s_)), kAccepted);
  EXPECT_LT(orders, 40u) << "as many as the control thread's ring holds are 64";
  // What is refused ends nothing, and after the next tick all goes on.
  view_.epoch.order = 1000;
  look();
  EXPECT_EQ(result(mission_.handle(gcs_.next(kHold), now_s_)), kAccepted);
}

// Row 39.
TEST_F(MissionTest, EveryEndingCommandHasALaterOrderThanWhatWasPlannedBefore) {
  for (const std::uint8_t verb : {kStop, kLand, kHold}) {
    const Decision go = give(gcs_.next(kGoto));
    ASSERT_TRUE(go.job);
    const Decision end = give(gcs_.next(verb));
    ASSERT_TRUE(end.order);
    EXPECT_GT(end.order->number, go.job->epoch.order);
    if (end.job) {
      EXPECT_EQ(end.job->kind, PlanJob::Kind::brake);
      EXPECT_EQ(end.job->epoch.order, end.order->number);
    }
    const PlanOutcome late{go.job->id, false, {"too late"}};
    look({&late, 1});
    EXPECT_NE(mission_.task(), "refused: too late") << "the outcome of a job that was ended is nobody's";
    const PlanOutcome brake{end.job ? end.job->id : 0, true, {}};
    look({&brake, 1});
  }
}

}  // namespace
}  // namespace backwash::daemon::test
