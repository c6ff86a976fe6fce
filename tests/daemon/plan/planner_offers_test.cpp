// SPDX-License-Identifier: BSD-3-Clause
// What the planner offers, and what it does not: alone against a control thread that the test plays.
#include "core/plan/rest.hpp"
#include "core/reach/rest.hpp"
#include "services/backwashd/control/flying.hpp"
#include "tests/daemon/plan/planner_rig.hpp"
#include "tests/daemon/plan/planner_watch_rig.hpp"

namespace backwash::daemon::test {
namespace {

TEST_F(PlannerOffers, ATakeoffThatArmsAndLiftsToTheLowestClearHeightAndAFlightFromThere) {
  know(room());
  stand({3.05, 2.05, 0.3});
  const auto column = plan::takeoff_column(*world_, view_.state.p_W, 0);
  ASSERT_TRUE(column);
  ASSERT_GT(column->z_safe, 0.35);
  EXPECT_EQ(ask(PlanJob::Kind::takeoff, {0, 0, 1.0}), "");
  ASSERT_EQ(offers_.size(), 2u);
  const auto& s = offers_[0];
  EXPECT_TRUE(s.arms);
  EXPECT_NEAR(s.commands.back().p_W.z(), std::max(column->z_safe, 0.6), 1e-9);
  EXPECT_FALSE(offers_[1].arms);
  EXPECT_EQ(offers_[1].commands.front().p_W, s.commands.back().p_W) << "from where the autopilot has lifted it";
  EXPECT_NEAR(offers_[1].commands.back().p_W.z(), 1.0, 1e-9);
  EXPECT_EQ(s.epoch, (track::Epoch{7, 2}));
  EXPECT_EQ(s.seen_ns, kSeen_ns);
  EXPECT_GT(s.clearance, 0);
  EXPECT_NEAR(s.clearance, plan::takeoff_clearance(*world_, s.tube, column->z_safe), 1e-9);
  EXPECT_FALSE(s.stops.empty());
  for (const Setpoint& c : s.commands) EXPECT_EQ(c.yaw, 0.3);
}

TEST_F(PlannerOffers, NoTakeoffToWhereHoveringIsNotSafe) {
  know(room());
  stand({3.05, 2.05, 0.3});
  EXPECT_NE(ask(PlanJob::Kind::takeoff, {0, 0, 1.9}).find("not safe"), std::string::npos);
  EXPECT_TRUE(offers_.empty());
}

// Above a low box beside it hovering is clear; on the way there it is not.
TEST_F(PlannerOffers, NoTakeoffWhoseTubeIsNotClear) {
  OccupancyGrid grid = room();
  fill(grid, {32, 18, 1}, {34, 22, 3});
  know(grid);
  stand({3.0, 2.05, 0.3});
  ASSERT_TRUE(plan::takeoff_column(*world_, view_.state.p_W, 0));
  EXPECT_NE(ask(PlanJob::Kind::takeoff, {0, 0, 1.2}).find("not clear"), std::string::npos);
  EXPECT_TRUE(offers_.empty());
}

TEST_F(PlannerOffers, AFlightWithItsTubeClearanceStopsAndHoverThatDoesNotArm) {
  know(room());
  stand({1.05, 2.05, 1.05});
  EXPECT_EQ(ask(PlanJob::Kind::go_to, {4.05, 2.05, 1.05}), "");
  ASSERT_EQ(offers_.size(), 1u);
  const auto& s = offers_[0];
  EXPECT_FALSE(s.arms);
  EXPECT_NEAR(s.clearance, plan::tube_clearance(*world_, s.tube), 1e-9);
  EXPECT_GT(s.stops.size(), 3u);
  ASSERT_GT(s.commands.size(), 150u);
  for (std::size_t n = s.commands.size() - reach::settling_periods(world_->reach); n < s.commands.size(); ++n) {
    EXPECT_LT((s.commands[n].p_W - Vec3(4.05, 2.05, 1.05)).norm(), 1e-6) << n;
    EXPECT_TRUE(s.commands[n].v_W.isZero());
  }
}

// docs/model.md 4-14: the pose that the tube begins with may be as old as that.
TEST_F(PlannerOffers, OfSlowOrLateOdometryAFlightThatWaitsForItsPosesAge) {
  const OdometryTiming timing{9, 0.12};
  PlannerWorker slow{*channels_, recorder_, [](const auto&) {}, [this] { control(); }, timing};
  know(room());
  stand({3.05, 2.05, 0.3});
  ASSERT_EQ(ask(PlanJob::Kind::takeoff, {0, 0, 1.0}, {7, 2}, &slow), "");
  ASSERT_EQ(offers_.size(), 2u);
  const auto rests = [](const track::AcceptedSegment& s) {
    std::size_t n = 0;
    while (s.commands[n].v_W.isZero(0) && s.commands[n].p_W == s.commands[0].p_W) ++n;
    return n;
  };
  EXPECT_LE(rests(offers_[0]), 1u) << "it stands";
  EXPECT_GE(static_cast<double>(rests(offers_[1])) * kControlPeriod, timing.oldest());
  stand(offers_[1].commands.back().p_W);
  ASSERT_EQ(ask(PlanJob::Kind::go_to, {4.05, 2.05, 1.05}, {7, 2}, &slow), "");
  const auto& s = offers_.back();
  EXPECT_GE(static_cast<double>(rests(s)) * kControlPeriod, timing.oldest());
  EXPECT_LT((s.commands.front().p_W - view_.command.p_W).norm(), 1e-9);
  EXPECT_NEAR(s.clearance, plan::tube_clearance(*world_, s.tube), 1e-9) << "verified with what it waits";
}

TEST_F(PlannerOffers, NothingForAGoalThatNoPlanReaches) {
  OccupancyGrid grid = room();
  fill(grid, {30, 0, 1}, {31, 39, 19});
  know(grid);
  stand({1.05, 2.05, 1.05});
  EXPECT_NE(ask(PlanJob::Kind::go_to, {5.05, 2.05, 1.05}), "");
  EXPECT_NE(ask(PlanJob::Kind::go_to, {3.05, 2.05, 1.05}), "");
  EXPECT_TRUE(offers_.empty());
}

// A planner that is starved may see 3 s pass at once: the world that came meanwhile is not to be overlooked.
TEST_F(PlannerOffers, AWayThatBecameKnownWhileThePlannerWasStarvedIsFlown) {
  OccupancyGrid known = room();
  const Vec3 here(1.55, 2.05, 1.05), goal(4.55, 2.05, 1.05);
  for (std::size_t n = 0; n < known.cell_count(); ++n)
    if (known.center(known.voxel(n)).x() > here.x() + 0.5) known.set(known.voxel(n), Cell::unknown);
  stand(here);
  know(known);
  EXPECT_NE(ask(PlanJob::Kind::go_to, goal).find("nothing more of the way became known"), std::string::npos);
  EXPECT_TRUE(offers_.empty());
  pause_ns_ = 3'000'000'000;
  meanwhile_ = [&] {
    know(room());
    meanwhile_ = [] {};
  };
  EXPECT_EQ(ask(PlanJob::Kind::go_to, goal), "");
  EXPECT_FALSE(offers_.empty());
}

TEST_F(PlannerOffers, NothingThatIsEndedAlreadyOrWithoutControl) {
  know(room());
  stand({1.05, 2.05, 1.05});
  EXPECT_NE(ask(PlanJob::Kind::go_to, {4.05, 2.05, 1.05}, {6, 2}), "") << "an earlier order's";
  EXPECT_NE(ask(PlanJob::Kind::go_to, {4.05, 2.05, 1.05}, {7, 1}), "") << "before the mode ended it";
  view_.mode = Mode::passive;
  show();
  EXPECT_NE(ask(PlanJob::Kind::go_to, {4.05, 2.05, 1.05}), "");
  EXPECT_TRUE(offers_.empty());
}

// The control thread refuses the first offer, and by then the vehicle has drifted to where its first set touches the
// wall.
TEST_F(PlannerOffers, NoFlightWhoseTubeFromTheNewestStateIsNotClear) {
  know(room());
  stand({1.05, 2.05, 1.05});
  answer_ = [&](const auto& s) {
    view_.refused_segment = s.id;
    view_.state.p_W.y() = 0.1;
  };
  EXPECT_NE(ask(PlanJob::Kind::go_to, {4.05, 2.05, 1.05}), "");
  EXPECT_EQ(offers_.size(), 1u);
}

// The control thread refuses the first offer: the next one is made only if nothing has ended the plan meanwhile.
TEST_F(PlannerOffers, WhereTheCauseOfAHoldLastsThatIsWhyNothingFlies) {
  for (const bool held : {false, true}) {
    stand({1.05, 2.05, 1.05});
    know(room());
    view_.mode = held ? Mode::hold : Mode::tracking;
    view_.reason = held ? Reason::frames_apart : Reason::autopilot_follows;
    show();
    answer_ = [&](const auto& s) { view_.refused_segment = s.id; };
    const std::string why = ask(PlanJob::Kind::go_to, {2.05, 2.05, 1.05});
    EXPECT_NE(why.find(held ? to_string(Reason::frames_apart) : "not still enough"), std::string::npos) << why;
  }
}

TEST_F(PlannerOffers, NothingMoreOnceALaterOrderOrALoopClosureCameBetweenTwoOffers) {
  for (const bool closure : {false, true}) {
    offers_.clear();
    know(room());
    stand({1.05, 2.05, 1.05});
    view_.closures = 0;
    answer_ = [&](const auto& s) {
      view_.refused_segment = s.id;
      if (closure)
        view_.closures = 1;
      else
        ++view_.epoch.order;
    };
    ask(PlanJob::Kind::go_to, {4.05, 2.05, 1.05});
    for (const auto& s : offers_) EXPECT_EQ(s.closures, &s == &offers_[0] ? 0u : 1u);
    if (!closure) {
      EXPECT_EQ(offers_.size(), 1u);
    }
    view_.epoch = {7, 2};
  }
}

/// A flight along x at 1 m/s that ends at x = 4.5 m, in the room with this in it.
Flying along_x(const plan::World& world, double slow_from = 4.0) {
  Flying f{};
  f.segment.id = 1;
  for (double x = 1; x < 4.5;) {
    const double v = x < slow_from ? 1.0 : std::max(0.05, std::sqrt(2 * 1.0 * (4.5 - x)));
    f.segment.commands.push_back({{x, 2.05, 1.05}, {v, 0, 0}, Vec3::Zero(), 0});
    x += v * kControlPeriod;
  }
  plan::hold_until_settled(world.reach, f.segment.commands);
  f.start = {{1, 2.05, 1.05}, {1, 0, 0}};
  f.previous = f.segment.commands.front();
  verify(f, world);
  return f;
}

// The room narrows at its beginning: what is left behind does not count.
TEST(FlyingGuards, TheClearanceAheadIsThatOfWhatIsStillToBeFlown) {
  OccupancyGrid grid = room();
  fill(grid, {10, 14, 1}, {12, 15, 19});
  const auto world = world_of(grid);
  Flying f = along_x(*world);
  add_guards(f, *world);
  const auto& ahead = f.segment.clearance_ahead;
  ASSERT_GT(ahead.size(), 3u);
  EXPECT_NEAR(ahead[0], f.segment.clearance, 1e-9);
  EXPECT_GT(ahead[2], ahead[0] + 0.1);
  for (std::size_t n = 0; n < ahead.size(); ++n)
    EXPECT_NEAR(ahead[n], clearance_from(f, *world, f.segment.tube, 50 * n), 1e-9) << n;
  add_guards(f, *world, 120);
  EXPECT_NEAR(f.segment.clearance_ahead[0], clearance_from(f, *world, f.segment.tube, 120), 1e-9)
      << "of what was flown already nothing counts";
}

// A wall before the end of the flight: the stops that need more room than there is are left out.
TEST(FlyingGuards, EveryStopThatIsOfferedIsClear) {
  OccupancyGrid grid = room();
  fill(grid, {38, 0, 1}, {39, 39, 19});
  const auto world = world_of(grid);
  Flying f = along_x(*world);
  EXPECT_LE(f.segment.clearance, 0);
  add_guards(f, *world);
  ASSERT_GT(f.segment.stops.size(), 3u);
  EXPECT_LT(f.segment.stops.back().branch, 140u);
  for (const plan::Stop& stop : f.segment.stops) EXPECT_GT(plan::tube_clearance(*world, stop.tube), 0) << stop.branch;
}

TEST_F(PlannerOffers, AGoalWhereTheMapIsStillBeingMadeIsToldApartFromOneOutsideOfIt) {
  know(room());
  stand({1, 2, 1});
  channels_->map_partial = true;
  EXPECT_NE(ask(PlanJob::Kind::go_to, {7, 2, 1}).find("still being made there"), std::string::npos);
  EXPECT_EQ(ask(PlanJob::Kind::go_to, {2, 2, 1}), "");
  channels_->map_partial = false;
  channels_->world_moves = true;
  const std::string beyond = ask(PlanJob::Kind::go_to, {90, 2, 1});
  EXPECT_NE(beyond.find("goal (90.00, 2.00, 1.00) is outside the world of the window, "), std::string::npos) << beyond;
  EXPECT_TRUE(beyond.ends_with(": use waypoints in it")) << beyond;
  channels_->world_moves = false;
  EXPECT_NE(ask(PlanJob::Kind::go_to, {7, 2, 1}).find("outside the map"), std::string::npos);
}

// By how much the autopilot's frame is off the map at rest: each way and each place of rest keeps that clear.

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

// How the planner waits for a lift-off, and what it watches meanwhile.

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
