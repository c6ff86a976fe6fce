// SPDX-License-Identifier: BSD-3-Clause
// What the planner does about a flight under way: in a new world, after a loop closure, when it is to brake. In rougher
// air: planner_air_test.cpp.
#include "core/plan/rest.hpp"
#include "core/plan/stop.hpp"
#include "tests/daemon/plan/planner_watch_rig.hpp"

namespace backwash::daemon::test {
namespace {

TEST_F(PlannerWatch, ATakeoffIsBlockedByWhatComesToStandInItsWayAndByNothingElse) {
  know(room());
  stand({3.05, 2.05, 0.3});
  ASSERT_EQ(ask(PlanJob::Kind::takeoff, {0, 0, 1.2}), "");
  view_.finished = false;
  show();
  OccupancyGrid grid = room();
  fill(grid, {50, 5, 1}, {52, 7, 19});
  know(grid);
  planner_.step();
  EXPECT_FALSE(blocked());
  fill(grid, {31, 19, 9}, {33, 21, 10});
  know(grid);
  planner_.step();
  EXPECT_EQ(channels_->blocked_segment, view_.segment);
}

TEST_F(PlannerWatch, AFlightGoesOnRoundAnObstacleWithVerifiedStops) {
  fly_past(1.4);
  know(walled(3.8, true));
  planner_.step();
  ASSERT_EQ(offers_.size(), 2u);
  const auto& s = offers_[1];
  EXPECT_FALSE(blocked());
  EXPECT_LT((s.commands.back().p_W - Vec3(5.05, 2.05, 1.05)).norm(), 1e-6);
  EXPECT_GT(s.clearance, 0);
  EXPECT_GT(s.stops.size(), 3u);
  for (const plan::Stop& stop : s.stops) EXPECT_GT(plan::tube_clearance(*world_, stop.tube), 0) << stop.branch;
}

TEST_F(PlannerWatch, AFlightWithoutAClearWayOnIsBlocked) {
  fly_past(2.5);
  know(walled(view_.state.p_W.x() + 0.6, false));
  planner_.step();
  EXPECT_EQ(channels_->blocked_segment, view_.segment);
  EXPECT_EQ(offers_.size(), 1u);
}

TEST_F(PlannerWatch, AFlightThatWasStoppedIsNotExtended) {
  fly_past(1.4);
  view_.mode = Mode::hold;
  view_.reason = Reason::operator_request;
  view_.braking = true;
  show();
  know(walled(3.8, true));
  planner_.step();
  EXPECT_EQ(offers_.size(), 1u);
}

TEST_F(PlannerWatch, AfterALoopClosureTheFlightGoesBackToItsPlaceInTheMapIfThatIsClear) {
  for (const double sideways : {0.1, -1.85}) {  // within the room, and against its side
    offers_.clear();
    view_ = {};
    channels_->blocked_segment = 0;
    fly_past(1.8);
    view_.closures = 1;
    view_.shift.t = {0, sideways, 0};
    show();
    planner_.step();
    const bool clear = sideways > 0;
    EXPECT_EQ(blocked(), !clear);
    ASSERT_EQ(offers_.size(), clear ? 2u : 1u);
    if (!clear) continue;
    EXPECT_EQ(offers_[1].closures, 1u);
    EXPECT_LT((offers_[1].commands.back().p_W - Vec3(5.05, 2.05, 1.05)).norm(), 1e-6);
  }
}

TEST_F(PlannerWatch, AfterALoopClosureAFlightThatWasToldToHoldStaysWhereItIs) {
  for (const bool at_rest : {false, true}) {
    offers_.clear();
    view_ = {};
    channels_->blocked_segment = 0;
    fly_past(1.8);
    if (at_rest) {
      view_.index = offers_.back().commands.size();
      view_.finished = true;
      show();
    }
    EXPECT_EQ(ask(PlanJob::Kind::brake, Vec3::Zero()), "");
    const std::vector<Setpoint> flown = offers_.back().commands;
    for (const std::uint32_t closures : {1u, 2u}) {
      view_.closures = closures;
      view_.shift.t = {0, 0.1, 0};
      show();
      planner_.step();
      EXPECT_FALSE(blocked());
      ASSERT_EQ(offers_.back().closures, closures);
      ASSERT_EQ(offers_.back().commands.size(), flown.size());
      for (std::size_t k = 0; k < flown.size(); k += 10)
        EXPECT_LT((offers_.back().commands[k].p_W - flown[k].p_W - Vec3(0, 0.1 * closures, 0)).norm(), 1e-9) << k;
    }
  }
}

// A narrow gap, passed 8 cm beside its middle: a set that rests there grows into its side, one that passes does not.
TEST_F(PlannerWatch, AHoldInANarrowGapIsARestBehindIt) {
  constexpr double kGap = 3.0;  // m, along x
  OccupancyGrid grid = room();
  fill(grid, {29, 0, 1}, {30, 15, 19});
  fill(grid, {29, 24, 1}, {30, 39, 19});
  know(grid);
  stand({1.05, 2.13, 1.05});
  ASSERT_EQ(ask(PlanJob::Kind::go_to, {5.05, 2.13, 1.05}), "");
  const track::AcceptedSegment flown = offers_.at(0);
  view_.index = 70;
  view_.command = flown.commands[view_.index];
  view_.state = flown.tube[view_.index].center;
  view_.finished = false;
  show();
  const auto at_once = plan::stop_along(flown.commands, view_.index + 15, world_->reach.vehicle.limits.a_max);
  ASSERT_LE(plan::tube_clearance(*world_, reach::tube_over_field(world_->reach, {flown.commands[0].p_W, Vec3::Zero()},
                                                                 flown.commands[0], at_once, world_->bounds)),
            0);

  EXPECT_EQ(ask(PlanJob::Kind::brake, Vec3::Zero()), "");
  ASSERT_EQ(offers_.size(), 2u);
  const auto& held = offers_[1];
  EXPECT_EQ(held.continues, flown.id);
  EXPECT_GT(held.clearance, 0);
  EXPECT_GT(held.commands.back().p_W.x(), kGap);
  EXPECT_LT(held.commands.back().p_W.x(), 5.0) << "it does not fly on to its goal";
  EXPECT_TRUE(held.commands.back().v_W.isZero());
  ASSERT_FALSE(held.stops.empty());
  EXPECT_LT(held.stops.front().branch, held.branch) << "on the way there it can still be stopped";
}

// A STOP after a HOLD: what slows down already has a stop ahead until it rests, and each comes to rest in the clear.
TEST_F(PlannerWatch, AFlightThatSlowsDownForAHoldHasAStopAheadUntilItRests) {
  fly_past(1.8);
  ASSERT_EQ(ask(PlanJob::Kind::brake, Vec3::Zero()), "");
  ASSERT_EQ(offers_.size(), 2u);
  const auto& held = offers_[1];
  std::size_t moving = 0;
  for (std::size_t k = view_.index; !held.commands.at(k).v_W.isZero(); ++k, ++moving) {
    const auto stop = std::ranges::find_if(held.stops, [&](const auto& s) { return s.branch >= k; });
    ASSERT_NE(stop, held.stops.end()) << k;
    EXPECT_LE(stop->branch, k + 10) << k;
    EXPECT_TRUE(stop->commands.back().v_W.isZero());
    EXPECT_LE(stop->commands.back().p_W.x(), held.commands.back().p_W.x() + 1e-9) << "no later than the hold";
    EXPECT_GT(plan::tube_clearance(*world_, stop->tube), 0);
    EXPECT_EQ(stop->tube.size(), stop->commands.size() + 1);
  }
  EXPECT_GT(moving, 30u);
}

// Past the gap at speed: a hold rests behind it, the harder stops rest in it and are not clear. Its own way is the
// stop.
TEST_F(PlannerWatch, WhereNoHarderStopIsClearAHoldsOwnWayIsTheStop) {
  OccupancyGrid grid = room();
  fill(grid, {29, 0, 1}, {30, 15, 19});
  fill(grid, {29, 24, 1}, {30, 39, 19});
  know(grid);
  stand({1.05, 2.13, 1.05});
  ASSERT_EQ(ask(PlanJob::Kind::go_to, {5.05, 2.13, 1.05}), "");
  const track::AcceptedSegment flown = offers_.at(0);
  const auto clear = [&](std::size_t branch, double a_max) {
    auto commands = plan::stop_along(flown.commands, branch, a_max);
    plan::hold_until_settled(world_->reach, commands);
    const auto tube = plan::tube_to_rest(*world_, {flown.commands[0].p_W, Vec3::Zero()}, flown.commands[0], commands);
    return plan::tube_clearance(*world_, tube) > 0;
  };
  const double a_max = world_->reach.vehicle.limits.a_max;
  std::size_t tried = 0;
  for (std::size_t now = 60; now < 140; ++now) {
    if (!clear(now + 15, a_max) || clear(now + 10, 2 * a_max) || clear(now + 20, 2 * a_max)) continue;
    ++tried;
    offers_.resize(1);
    view_.segment = flown.id;
    view_.index = now;
    view_.command = flown.commands[now];
    view_.state = flown.tube[now].center;
    view_.finished = false;
    show();
    ASSERT_EQ(ask(PlanJob::Kind::brake, Vec3::Zero()), "");
    ASSERT_EQ(offers_.size(), 2u);
    const auto stop = std::ranges::find_if(offers_[1].stops, [&](const auto& x) { return x.branch >= now + 15; });
    ASSERT_NE(stop, offers_[1].stops.end());
    EXPECT_EQ(stop->branch, now + 15);
    EXPECT_EQ(stop->commands.back().p_W, offers_[1].commands.back().p_W);
    break;
  }
  EXPECT_EQ(tried, 1u);
}

// A STOP in the last 0.2 s of a flight.
TEST_F(PlannerWatch, AFlightHasAStopAheadUntilItRests) {
  fly_past(1.8);
  const auto& flown = offers_.at(0);
  for (std::size_t k = view_.index; !flown.commands.at(k).v_W.isZero(); ++k) {
    const auto stop = std::ranges::find_if(flown.stops, [&](const auto& s) { return s.branch >= k; });
    ASSERT_NE(stop, flown.stops.end()) << k << " of " << flown.commands.size();
    EXPECT_GT(plan::tube_clearance(*world_, stop->tube), 0);
  }
}

TEST_F(PlannerWatch, BrakingThatWouldTouchIsNotOffered) {
  fly_past(2.5);
  know(walled(view_.state.p_W.x() + 0.6, false));
  EXPECT_NE(ask(PlanJob::Kind::brake, Vec3::Zero()).find("not clear"), std::string::npos);
  EXPECT_EQ(offers_.size(), 1u);
}

}  // namespace
}  // namespace backwash::daemon::test
