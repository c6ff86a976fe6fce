// SPDX-License-Identifier: BSD-3-Clause
// By how much the autopilot's frame is off the map at rest: each way and each place of rest keeps that clear.
#include "core/plan/rest.hpp"
#include "tests/daemon/plan/planner_watch_rig.hpp"

namespace backwash::daemon::test {
namespace {

// Its controller does not see that error: what a set leaves to the walls has to be more.
TEST_F(PlannerOffers, NoFlightThatIsClearByLessThanTheAutopilotsFrameIsOff) {
  know(room());
  stand({1.05, 2.05, 1.05});
  ASSERT_EQ(ask(PlanJob::Kind::go_to, {4.05, 2.05, 1.05}), "");
  ASSERT_GT(offers_.at(0).clearance, 0.1);
  offers_.clear();
  view_.segment = 0;
  view_.residual_m = 0.9;  // more than from here to the floor
  stand({1.05, 2.05, 1.05});
  EXPECT_NE(ask(PlanJob::Kind::go_to, {4.05, 2.05, 1.05}), "");
  EXPECT_TRUE(offers_.empty());
  view_.residual_m = 0.05;
  stand({1.05, 2.05, 1.05});
  EXPECT_EQ(ask(PlanJob::Kind::go_to, {4.05, 2.05, 1.05}), "");
  ASSERT_EQ(offers_.size(), 1u);
  EXPECT_GT(offers_[0].clearance, 0.05);
}

TEST_F(PlannerOffers, NoTakeOffToWhereTheFramesLeaveTooLittle) {
  know(room());
  stand({3.05, 2.05, 0.3});
  view_.residual_m = 0.9;
  show();
  EXPECT_NE(ask(PlanJob::Kind::takeoff, {0, 0, 1.0}).find("no clear hover height"), std::string::npos);
  view_.residual_m = 0.2;
  show();
  EXPECT_NE(ask(PlanJob::Kind::takeoff, {0, 0, 1.65}).find("height asked for is not safe"), std::string::npos);
  EXPECT_TRUE(offers_.empty());
  // Room enough to hover, and too little beside the way up.
  OccupancyGrid grid = room();
  fill(grid, {34, 0, 1}, {35, 39, 2});
  know(grid);
  std::vector<std::string> answers;
  for (view_.residual_m = 0.2; view_.residual_m > 0 && offers_.empty(); view_.residual_m -= 0.005) {
    stand({3.05, 2.05, 0.3});
    answers.push_back(ask(PlanJob::Kind::takeoff, {0, 0, 1.5}));
  }
  ASSERT_EQ(answers.back(), "");
  EXPECT_NE(answers[answers.size() - 2].find("the way up is not clear enough"), std::string::npos);
}

// As high as it takes: where it rests after the lift-off is asked with the same figure as the way there.
TEST_F(PlannerOffers, ATakeOffIsLiftedToWhereTheFramesLeaveEnough) {
  know(room());
  const auto lowest = plan::takeoff_column(*world_, {3.05, 2.05, 0.3}, 0);
  for (const double apart : {0.04, 0.14, 0.24}) {
    offers_.clear();
    view_ = {};
    view_.residual_m = apart;
    stand({3.05, 2.05, 0.3});
    EXPECT_EQ(ask(PlanJob::Kind::takeoff, {0, 0, 1.2}), "") << apart;
    const auto column = plan::takeoff_column(*world_, {3.05, 2.05, 0.3}, apart);
    ASSERT_TRUE(lowest && column && !offers_.empty());
    const double top = offers_[0].commands.back().p_W.z();
    EXPECT_GE(top, column->z_safe);
    EXPECT_GT(offers_[0].clearance, apart);
    EXPECT_EQ(offers_[0].apart_m, apart) << "the control thread looks out by it";
    EXPECT_TRUE(apart < 0.1 || column->z_safe > lowest->z_safe + 0.05);
  }
}

// Not refused when it is offered: planned wider from the start.
TEST_F(PlannerOffers, APlanAroundACornerKeepsWhatTheFramesAreApart) {
  OccupancyGrid grid = room();
  fill(grid, {28, 0, 1}, {29, 19, 19});
  know(grid);
  const auto clearance = [&](double residual) {
    offers_.clear();
    view_.segment = 0;
    view_.residual_m = residual;
    stand({1.05, 1.05, 1.05});
    EXPECT_EQ(ask(PlanJob::Kind::go_to, {5.05, 1.05, 1.05}), "");
    return offers_.empty() ? 0 : offers_[0].clearance;
  };
  const double without = clearance(0);
  ASSERT_LT(without, 0.2);
  EXPECT_GT(clearance(without + 0.05), without + 0.05);
}

// The same towards what is not known yet: the first way from rest.
TEST_F(PlannerOffers, AWayTowardsTheUnknownKeepsWhatTheFramesAreApart) {
  OccupancyGrid grid = room();
  fill(grid, {28, 0, 1}, {29, 19, 19});
  for (int k = 1; k < 20; ++k)
    for (int j = 0; j < 40; ++j)
      for (int i = 50; i < 60; ++i) grid.set({i, j, k}, Cell::unknown);
  know(grid);
  const auto clearance = [&](double residual) {
    offers_.clear();
    view_.segment = 0;
    view_.residual_m = residual;
    stand({1.05, 1.05, 1.05});
    EXPECT_EQ(ask(PlanJob::Kind::go_to, {5.35, 1.05, 1.05}), "");
    return offers_.empty() ? 0 : offers_[0].clearance;
  };
  const double without = clearance(0);
  ASSERT_GT(without, 0);
  EXPECT_LT((offers_.at(0).commands.back().p_W - Vec3(1.05, 1.05, 1.05)).norm(), 4.1) << "it does not come to the goal";
  EXPECT_GT(clearance(without + 0.03), without + 0.03);
}

// What it shows in motion is delay: what flies keeps what was measured when it began.
TEST_F(PlannerWatch, WhatContinuesAFlightKeepsWhatTheFramesWereApartWhenItBegan) {
  const std::vector<std::function<void()>> events{[&] { EXPECT_EQ(ask(PlanJob::Kind::brake, Vec3::Zero()), ""); },
                                                  [&] {
                                                    view_.closures = 1;
                                                    view_.shift.t = {0, 0.1, 0};
                                                    show();
                                                    planner_.step();
                                                  },
                                                  [&] {
                                                    know(walled(3.8, true));
                                                    planner_.step();
                                                  }};
  for (const auto& event : events) {
    offers_.clear();
    view_ = {};
    view_.residual_m = 0.03;
    fly_past(1.4);
    view_.residual_m = 0.2;
    show();
    event();
    ASSERT_EQ(offers_.size(), 2u);
    EXPECT_EQ(offers_[0].apart_m, 0.03);
    EXPECT_EQ(offers_[1].continues, offers_[0].id);
    EXPECT_EQ(offers_[1].apart_m, 0.03);
    EXPECT_GT(offers_[1].clearance, 0.03);
  }
}

// A flight that is clear in the new map by less than that is not clear: it goes round.
TEST_F(PlannerWatch, AFlightGoesRoundWhatLeavesLessThanTheFramesAreApart) {
  constexpr double kApart = 0.2;
  view_.residual_m = kApart;
  fly_past(1.4);
  OccupancyGrid grid = room();
  fill(grid, {38, 25, 1}, {39, 39, 19});
  know(grid);
  const auto& s = offers_.at(0);
  const auto tube = plan::tube_to_rest(*world_, s.tube[0].center, s.commands[0], s.commands);
  const double left = plan::tube_clearance(*world_, tube);
  ASSERT_GT(left, 0);
  ASSERT_LT(left, kApart);
  planner_.step();
  ASSERT_EQ(offers_.size(), 2u);
  EXPECT_GT(offers_[1].clearance, kApart);
}

// Stops rest nearer to obstacles than the flight passes them.
TEST_F(PlannerOffers, NoStopThatRestsWhereTheFramesLeaveTooLittle) {
  OccupancyGrid grid = room();
  fill(grid, {28, 0, 1}, {29, 16, 19});
  fill(grid, {28, 24, 1}, {29, 39, 19});
  know(grid);
  const auto resting_within = [&](double residual) {
    offers_.clear();
    view_.segment = 0;
    view_.residual_m = residual;
    stand({1.05, 2.05, 1.05});
    EXPECT_EQ(ask(PlanJob::Kind::go_to, {5.05, 2.05, 1.05}), "");
    double least = INFINITY;
    for (const plan::Stop& s : offers_.at(0).stops) least = std::min(least, plan::tube_clearance(*world_, s.tube));
    return least;
  };
  const double at_rest = resting_within(0), on_the_way = offers_[0].clearance;
  ASSERT_GT(at_rest, 0);
  ASSERT_LT(at_rest, on_the_way - 1e-3);
  const double between = (at_rest + on_the_way) / 2;
  EXPECT_GT(resting_within(between), between);
}

}  // namespace
}  // namespace backwash::daemon::test
