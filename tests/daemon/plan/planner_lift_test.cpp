// SPDX-License-Identifier: BSD-3-Clause
// How the planner waits for a lift-off, and what it watches meanwhile.
#include "tests/daemon/plan/planner_rig.hpp"

namespace backwash::daemon::test {
namespace {

using PlannerLift = PlannerOffers;

// Whatever became of the lift-off: the job ends, and what was planned after it is not offered.
TEST_F(PlannerLift, ATakeoffEndsWithItsLiftOffHoweverThatEnds) {
  const std::function<void()> ends[] = {
      // accepted in the tick in which something came in its way: a hold that is no lapse
      [&] {
        view_.mode = Mode::hold;
        view_.reason = Reason::obstacle_ahead;
      },
      [&] {
        view_.mode = Mode::hold;
        view_.segment = 0;
      },
      [&] {
        view_.mode = Mode::passive;
        view_.segment = 0;
      },
      [&] { view_.mode = Mode::quiet; },
      [&] { view_.mode = Mode::land; },
      [&] {
        view_.mode = Mode::tracking;
        view_.segment = offers_.back().id;
      },
      [&] {
        view_.mode = Mode::lifting;
        view_.segment = offers_.back().id + 1;
      },
      [&] { ++view_.epoch.order; },
      [&] { channels_->stop = true; },
  };
  know(room());
  for (const auto& end : ends) {
    offers_.clear();
    view_.segment = 0;
    stand({3.05, 2.05, 0.3});
    int pauses = 0;
    meanwhile_ = [&] {
      if (offers_.empty()) return;
      view_.mode = Mode::lifting;
      view_.segment = offers_.back().id;
      if (pauses++ > 3) end();
      if (pauses > 500) channels_->stop = true;
    };
    EXPECT_NE(ask(PlanJob::Kind::takeoff, {0, 0, 1.0}), "") << &end - ends;
    EXPECT_LE(pauses, 200) << &end - ends;
    EXPECT_EQ(offers_.size(), 1u) << &end - ends;
    channels_->stop = false;
  }
}

// It may take its twelve seconds: what comes to stand over the vehicle meanwhile ends it.
TEST_F(PlannerLift, ANewWorldDuringTheLiftIsVerifiedBeforeItIsOver) {
  know(room());
  stand({3.05, 2.05, 0.3});
  int pauses = 0;
  meanwhile_ = [&] {
    if (offers_.empty()) return;
    view_.mode = Mode::lifting;
    view_.segment = offers_.back().id;
    OccupancyGrid changed = room();
    if (++pauses == 5) know(changed);  // clear as before
    if (pauses == 10) {
      EXPECT_EQ(channels_->blocked_segment, 0u);
      fill(changed, {28, 18, 8}, {32, 22, 9});
      know(changed);
    }
    if (pauses >= 15) {
      view_.mode = Mode::land;
      ++view_.epoch.lapse;
    }
  };
  EXPECT_NE(ask(PlanJob::Kind::takeoff, {0, 0, 1.0}).find("ended"), std::string::npos);
  EXPECT_EQ(channels_->blocked_segment, offers_.at(0).id);
}

}  // namespace
}  // namespace backwash::daemon::test
