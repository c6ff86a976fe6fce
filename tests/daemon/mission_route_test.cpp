// SPDX-License-Identifier: BSD-3-Clause
// When a route goes on by itself, and when it does not.
#include "tests/daemon/mission_rig.hpp"

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

TEST_F(MissionTest, AStopThatALandingCannotObeyIsNotToldToBeDone) {
  view_.mode = Mode::land;
  look();
  const Decision stop = give(gcs_.next(kStop));
  EXPECT_EQ(result(stop), kRefused);
  EXPECT_NE(stop.answer->reason.find("landing"), std::string::npos);
}

}  // namespace
}  // namespace backwash::daemon::test
