// SPDX-License-Identifier: BSD-3-Clause
// The daemon's planner by a stated risk: what it offers, its stops and its places of rest keep it.
#include <gmock/gmock.h>

#include "core/plan/search/ends.hpp"
#include "services/backwashd/control/flying.hpp"
#include "tests/daemon/plan/planner_rig.hpp"

namespace backwash::daemon::test {
namespace {

constexpr double kTouch = 1e-3;

class PlannerByRisk : public PlannerOffers {
 protected:
  static Vehicle vehicle() {
    Vehicle vehicle = vehicle_5in();
    vehicle.controller.kp = {1.71, 1.71};
    vehicle.controller.kd = {1.8, 1.8};  // PX4's own defaults
    return vehicle;
  }
  /// A room with a wall across it, and a gap of so many voxels in that.
  static OccupancyGrid gap(int voxels) {
    OccupancyGrid grid = room();
    fill(grid, {29, 0, 1}, {30, 19 - voxels / 2, 19});
    fill(grid, {29, 20 + (voxels + 1) / 2, 1}, {30, 39, 19});
    return grid;
  }
  void know(const OccupancyGrid& grid, const Model& model) {
    world_ = plan::build_world(grid, model, vehicle());
    channels_->worlds.offer({world_, kSeen_ns});
  }
  Model by_risk_ = plan::model_for({}, vehicle(), kTouch);
};

TEST_F(PlannerByRisk, FliesWhereTheWorstCaseRefusesAndAllThatItOffersKeepsTheRisk) {
  const Vec3 from(1.05, 2.0, 1.05), to(5.05, 2.0, 1.05);
  const OccupancyGrid grid = gap(9);
  know(grid, {});
  stand(from);
  EXPECT_NE(ask(PlanJob::Kind::go_to, to), "");
  ASSERT_TRUE(offers_.empty());
  know(grid, by_risk_);
  stand(from);
  ASSERT_EQ(ask(PlanJob::Kind::go_to, to), "");
  const auto& s = offers_.at(0);
  EXPECT_GT(s.worst, 1.5);
  const auto flight = plan::risk_of(*world_, s.tube);
  EXPECT_LE(flight.total, kTouch);
  EXPECT_GT(flight.total, 1e-6);
  EXPECT_LE(flight.a_minute, kTouch);
  ASSERT_GT(s.stops.size(), 3u);
  for (const plan::Stop& stop : s.stops) {
    reach::ReachTube whole(s.tube.begin(), s.tube.begin() + static_cast<std::ptrdiff_t>(stop.branch));
    whole.insert(whole.end(), stop.tube.begin(), stop.tube.end());
    const auto risk = plan::risk_of(*world_, whole);
    EXPECT_LE(risk.total, kTouch) << stop.branch;
    EXPECT_LE(risk.a_minute, kTouch) << stop.branch;
  }
}

// What the frames are apart is taken off by the risk, too: its controller does not see it.
TEST_F(PlannerByRisk, KeepsTheRiskBesideWhatTheFramesAreApart) {
  for (const double apart : {0.0, 0.04, 0.08, 0.12}) {
    know(gap(11), by_risk_);
    offers_.clear();
    view_ = {};
    view_.residual_m = apart;
    stand({1.05, 2.0, 1.05});
    const auto refused = ask(PlanJob::Kind::go_to, {5.05, 2.0, 1.05});
    ASSERT_TRUE(apart > 0 || refused.empty()) << refused;
    if (refused.empty()) {
      EXPECT_LE(plan::risk_of(*world_, offers_.at(0).tube, 0, apart).total, kTouch) << apart;
    }
  }
  const auto risk = [&](double apart) { return plan::risk_of(*world_, offers_.at(0).tube, 0, apart).total; };
  know(gap(11), by_risk_);
  offers_.clear();
  view_ = {};
  stand({1.05, 2.0, 1.05});
  ASSERT_EQ(ask(PlanJob::Kind::go_to, {5.05, 2.0, 1.05}), "");
  EXPECT_GT(risk(0.12), 10 * risk(0));
  const double clearance = plan::tube_clearance(*world_, offers_[0].tube);
  EXPECT_GT(clearance, 0.12) << "of the sets alone that would do";
  EXPECT_EQ(plan::tube_clearance(*world_, offers_[0].tube, 0, 0.2), 0);
  Model stricter = by_risk_;
  stricter.bound.stated->touch = 1e-6;
  know(gap(11), stricter);
  Flying flying{offers_[0], view_.state, view_.command, {}, {}};
  for (const double apart : {0.0, 0.12}) {
    flying.segment.apart_m = apart;
    verify(flying, *world_);
    EXPECT_EQ(flying.clear(), apart == 0) << "what flies is asked as its plan was";
  }
}

TEST_F(PlannerByRisk, IsKeptOnTheWayAndInAMinuteAtItsEnd) {
  know(room(), by_risk_);
  const auto keeps = [&](double way, double a_minute) {
    return plan::keeps(*world_, {.total = way, .a_minute = a_minute});
  };
  EXPECT_TRUE(keeps(kTouch, kTouch));
  EXPECT_FALSE(keeps(1.01 * kTouch, 0));
  EXPECT_FALSE(keeps(0, 1.01 * kTouch));
  know(room(), Model{});
  EXPECT_TRUE(keeps(1, 1)) << "where none is stated";
}

TEST_F(PlannerByRisk, SaysThatItIsTheRiskThatIsNotKept) {
  Model stricter = by_risk_;
  know(room(), by_risk_);
  const auto column = plan::takeoff_column(*world_, {3.05, 2.05, 0.3}, 0);
  ASSERT_TRUE(column);
  stricter.bound.stated->touch = 1e-15;
  know(room(), stricter);
  stand({3.05, 2.05, 0.3});
  EXPECT_THAT(ask(PlanJob::Kind::takeoff, {0, 0, column->z_safe}), testing::HasSubstr("does not keep the stated risk"));
}

// The set of a moment would be clear there: the way leads by, and nobody is left there.
TEST_F(PlannerByRisk, RestsWhereAMinuteKeepsTheRiskAndPassesWhereAMomentDoes) {
  know(gap(11), by_risk_);
  const Vec3 in_the_gap(3.0, 2.0, 1.05);
  ASSERT_TRUE(world_->safe.passable(world_->grid.index(in_the_gap)));
  EXPECT_FALSE(plan::may_rest_at(*world_, in_the_gap, 0));
  stand({1.05, 2.0, 1.05});
  EXPECT_NE(ask(PlanJob::Kind::go_to, in_the_gap).find("goal"), std::string::npos);
  stand(in_the_gap);
  EXPECT_EQ(ask(PlanJob::Kind::go_to, {5.05, 2.0, 1.05}), "") << "who is there may leave";
  offers_.clear();
  view_.segment = 0;
  stand({1.05, 2.0, 1.05});
  ASSERT_EQ(ask(PlanJob::Kind::go_to, {5.05, 2.0, 1.05}), "");
  for (const plan::Stop& stop : offers_.at(0).stops)
    EXPECT_GT(std::abs(stop.commands.back().p_W.x() - 3.0), 0.1) << stop.branch;
}

// One look at the newest world, as after a map that changed: what no longer keeps the risk is stopped.
TEST_F(PlannerByRisk, AMapThatTakesTheRoomStopsTheFlight) {
  know(gap(9), by_risk_);
  stand({1.05, 2.0, 1.05});
  ASSERT_EQ(ask(PlanJob::Kind::go_to, {5.05, 2.0, 1.05}), "");
  const auto id = offers_.at(0).id;
  Model stricter = by_risk_;  // the sets are the same: the risk alone says no
  stricter.bound.stated->touch = 1e-9;
  know(gap(9), stricter);
  view_.finished = false;
  show();
  EXPECT_EQ(plan::tube_clearance(*world_, offers_.at(0).tube), 0);
  for (int n = 0; n < 20 && channels_->blocked_segment != id && offers_.size() < 2; ++n) planner_.step();
  EXPECT_TRUE(channels_->blocked_segment == id || offers_.size() > 1);
}

}  // namespace
}  // namespace backwash::daemon::test
