// SPDX-License-Identifier: BSD-3-Clause
// When a route goes on by itself, and when it does not.
#include "tests/daemon/plan/mission_rig.hpp"

namespace backwash::daemon::test {
namespace {

/// Two waypoints, neither of them here; the first is being planned.
class Route : public MissionTest {
 protected:
  void SetUp() override {
    MissionTest::SetUp();
    CommandMessage follow = gcs_.next(kFollow);
    follow.waypoints = 2;
    follow.waypoint[0] = {0, 0, 1.2};
    follow.waypoint[1] = {1, 0, 1.2};
    const Decision planned = give(follow);
    ASSERT_TRUE(planned.job) << planned.answer->reason;
    job_ = planned.job->id;
  }
  Decision ended(bool ok) {
    const PlanOutcome outcome{job_, ok, {}};
    return look({&outcome, 1});
  }
  std::uint64_t job_ = 0;
};

TEST_F(Route, EndsWhereNoWayWasFound) {
  EXPECT_FALSE(ended(false).job);
  now_s_ += 5;
  EXPECT_FALSE(look().job) << "an operator is told, and nothing starts by itself";
}

TEST_F(Route, GoesOnFromTheEndOfAFlightAndNotFromARestOnTheWay) {
  view_.finished = false;
  ended(true);
  now_s_ += 5;
  EXPECT_FALSE(look().job) << "slow, but not at its end";
  view_.finished = true;
  view_.command.p_W = {0, 0, 1.2};
  EXPECT_TRUE(look().job);
}

/// Three places, of which the first and the last are one: east is faced from the first, nothing from the second, and
/// from the last what is behind and below.
CommandMessage turned_route(Station& station) {
  CommandMessage follow = station.next(kFollowFacing);
  follow.waypoints = 6;
  follow.waypoint[0] = {0, 0, 1.2};
  follow.waypoint[1] = {1, 0, 1.2};
  follow.waypoint[2] = {1, 0, 1.2};
  follow.waypoint[3] = {1, 0, 5};
  follow.waypoint[4] = {0, 0, 1.2};
  follow.waypoint[5] = {-3, -3, 0};
  return follow;
}

TEST_F(MissionTest, ARouteWithHeadingsTurnsToWhatIsFacedFromEachPlaceAndTellsHowFarItIs) {
  const Decision planned = give(turned_route(gcs_));
  ASSERT_TRUE(planned.job) << planned.answer->reason;
  std::vector<PlanJob> jobs{*planned.job};
  for (const char* to_go : {"waypoints to go: 3", "waypoints to go: 2"}) {
    const PlanOutcome flies{jobs.back().id, true, {}};
    view_.finished = false;
    EXPECT_FALSE(look({&flies, 1}).job);
    EXPECT_EQ(mission_.task(), to_go);
    view_.finished = true;
    view_.command.p_W = jobs.back().position;
    const Decision next = look();
    ASSERT_TRUE(next.job);
    EXPECT_EQ(mission_.task(), "planning");
    jobs.push_back(*next.job);
  }
  const PlanOutcome last{jobs.back().id, true, {}};
  view_.finished = false;
  look({&last, 1});
  EXPECT_EQ(mission_.task(), "") << "on the way to the last place nothing more is to come";
  EXPECT_EQ(jobs[0].position, Vec3(0, 0, 1.2));
  EXPECT_EQ(jobs[1].position, Vec3(1, 0, 1.2));
  EXPECT_EQ(jobs[2].position, Vec3(0, 0, 1.2));
  ASSERT_TRUE(jobs[0].yaw && jobs[2].yaw);
  EXPECT_NEAR(*jobs[0].yaw, 0, 1e-12);
  EXPECT_EQ(jobs[1].yaw, std::nullopt) << "what is straight above is faced from every heading";
  EXPECT_NEAR(*jobs[2].yaw, -0.75 * M_PI, 1e-12);
}

TEST_F(MissionTest, ARouteThatAHoldEndsTellsOfNoWaypointsToGo) {
  const Decision planned = give(turned_route(gcs_));
  ASSERT_TRUE(planned.job);
  const PlanOutcome flies{planned.job->id, true, {}};
  view_.finished = false;
  look({&flies, 1});
  view_.mode = Mode::hold;
  view_.reason = Reason::odometry_lost;
  look();
  EXPECT_EQ(mission_.task(), "");
}

// An operator ends a hold by a route. Its first way is being planned while the hold lasts, and a moment longer.
TEST_F(MissionTest, ARouteThatEndsAHoldIsFlownToItsLastPlace) {
  view_.mode = Mode::hold;
  view_.reason = Reason::map_late;
  view_.epoch.lapse = 3;
  look();
  const Decision planned = give(turned_route(gcs_));
  ASSERT_TRUE(planned.job) << planned.answer->reason;
  look();
  const PlanOutcome flies{planned.job->id, true, {}};
  EXPECT_FALSE(look({&flies, 1}).job);
  EXPECT_EQ(mission_.task(), "waypoints to go: 3") << "held still";
  view_.mode = Mode::tracking;
  view_.reason = Reason::segment_accepted;
  view_.finished = false;
  look();
  view_.finished = true;
  view_.command.p_W = planned.job->position;
  const Decision next = look();
  ASSERT_TRUE(next.job) << "on to the second place";
  EXPECT_EQ(next.job->position, Vec3(1, 0, 1.2));
}

TEST_F(MissionTest, ARouteThatEndsAHoldIsEndedByTheNextOne) {
  view_.mode = Mode::hold;
  view_.reason = Reason::map_late;
  view_.epoch.lapse = 3;
  look();
  const Decision planned = give(turned_route(gcs_));
  ASSERT_TRUE(planned.job);
  const PlanOutcome flies{planned.job->id, true, {}};
  look({&flies, 1});
  view_.epoch.lapse = 4;
  look();
  EXPECT_EQ(mission_.task(), "") << "held for something else before it began";
  const Decision again = give(turned_route(gcs_));
  ASSERT_TRUE(again.job);
  const PlanOutcome then{again.job->id, true, {}};
  view_.mode = Mode::tracking;
  look({&then, 1});
  view_.mode = Mode::hold;
  look();
  EXPECT_EQ(mission_.task(), "") << "a hold after its flight began";
}

TEST_F(MissionTest, ARouteOfHalfPairsOrOfWhatIsNoNumberIsInvalid) {
  CommandMessage odd = turned_route(gcs_);
  odd.waypoints = 5;
  EXPECT_EQ(result(give(odd)), kInvalid);
  CommandMessage faced = turned_route(gcs_);
  faced.waypoint[3] = {NAN, 0, 0};
  const Decision d = give(faced);
  EXPECT_EQ(result(d), kInvalid);
  EXPECT_FALSE(d.job);
}

TEST_F(MissionTest, AStopThatALandingCannotObeyIsNotToldToBeDone) {
  view_.mode = Mode::land;
  look();
  const Decision stop = give(gcs_.next(kStop));
  EXPECT_EQ(result(stop), kRefused);
  EXPECT_NE(stop.answer->reason.find("landing"), std::string::npos);
}

}  // namespace
}  // namespace backwash::daemon::test
