// SPDX-License-Identifier: BSD-3-Clause
// STOP and what else ends a flight, as the mission takes it (docs/faults.md rows 39 and 48).
#include "tests/daemon/plan/mission_rig.hpp"

namespace backwash::daemon::test {
namespace {

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

TEST_F(MissionTest, ARepeatedStopIsAnsweredAgainAndNotDoneAgain) {
  ASSERT_TRUE(give(gcs_.next(kStop)).order);
  const Decision again = give(gcs_.at(gcs_.sequence, kStop));
  EXPECT_EQ(result(again), kAccepted);
  EXPECT_FALSE(again.order);
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
