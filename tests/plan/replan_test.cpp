// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/replan.hpp"

#include <gtest/gtest.h>

#include "core/config/config.hpp"
#include "core/sim/flight.hpp"
#include "tests/plan/drawn.hpp"

namespace backwash::plan {
namespace {

using map::Cell;
using map::OccupancyGrid;

/// Room 0…6 × 0…4 × 0…1.8 m with a 0.1 m wall at x = 3 that leaves y > 2.6 open: the straight way is a dead end.
OccupancyGrid truth() {
  OccupancyGrid grid({-0.1, -0.1, -0.1}, 0.1, {62, 42, 20}, Cell::occupied);
  fill(grid, {0, 0, 0}, {6, 4, 1.8}, Cell::free);
  fill(grid, {3, 0, 0}, {3.1, 2.6, 1.8}, Cell::occupied);
  return grid;
}

/// What a range sensor sees: every voxel within its range up to the first occupied one on the way to it.
void reveal(OccupancyGrid& known, const OccupancyGrid& world, const Vec3& p_W, double range) {
  for (std::size_t n = 0; n < world.cell_count(); ++n) {
    const Vec3 to = world.center(world.voxel(n)) - p_W;
    const double distance = to.norm();
    if (distance > range || known.at(n) != Cell::unknown) continue;
    for (double s = 0;; s += 0.025) {
      const Index3 v = world.index(p_W + std::min(1.0, s / std::max(distance, 1e-9)) * to);
      if (!world.inside(v)) break;
      known.set(v, world.at(v));
      if (world.at(v) == Cell::occupied || s >= distance) break;
    }
  }
}

std::shared_ptr<const World> world_of(const OccupancyGrid& grid) {
  Model model = config::load_model("builtin:quad-5in").value();
  // Worlds of short range build fast.
  model.ground.l_max = model.ground.l_footprint_max = model.corner.l_max = model.wall.l_max = 0.6;
  return build_world(grid, model, config::load_vehicle("builtin:quad-5in").value());
}

Route hovering(const World& world, const Vec3& p_W) {
  Route route{{p_W, Vec3::Zero()}, {p_W, Vec3::Zero(), Vec3::Zero(), 0}, {}, {}};
  route.commands.assign(20, route.previous);
  route.tube = reach::tube_over_field(world.reach, route.start, route.previous, route.commands, world.bounds);
  return route;
}

void expect_continuous(const Setpoint& before, const Setpoint& after, double yaw_rate) {
  EXPECT_LT((after.p_W - before.p_W - kControlPeriod / 2 * (before.v_W + after.v_W)).norm(), 1e-3);
  EXPECT_LT((after.v_W - before.v_W - kControlPeriod / 2 * (before.a_W + after.a_W)).norm(), 5e-3);
  EXPECT_LT((after.a_W - before.a_W).norm(), 0.5);  // a jerk of 25 m/s³: no step of the acceleration
  EXPECT_LE(std::abs(after.yaw - before.yaw), yaw_rate * kControlPeriod + 1e-9);
}

TEST(Replan, FliesThroughAnUnknownRoomToAGoalBehindAWallWithoutContact) {
  const OccupancyGrid room = truth();
  OccupancyGrid known(room.origin(), 0.1, room.size(), Cell::unknown);
  const Vec3 start_W(1.05, 1.05, 0.95), goal_W(5.05, 0.95, 0.95);
  reveal(known, room, start_W, 2.2);
  ASSERT_FALSE(known.free(known.index(goal_W)));
  auto world = world_of(known);
  const Vehicle vehicle = world->reach.vehicle;  // the world is rebuilt under way
  const map::DistanceField distance(room);
  const ReplanOptions options{{1.0, 1.5}, 3.0};
  sim::ClosedLoop loop(room, vehicle, {start_W, Vec3::Zero()}, 1);
  Route route = hovering(*world, start_W);
  Setpoint last = route.previous;
  std::size_t extended = 0, contacts = 0;
  bool arrived = false;
  for (std::size_t k = 0; k < 50 * 60 && !arrived; ++k) {
    if (k % 25 == 0) {
      reveal(known, room, loop.estimated().p_W, 2.2);
      world = world_of(known);
      auto next = replan(*world, route, k, k + 10, goal_W, options);
      ASSERT_NE(next.kind, Replan::Kind::unsafe) << next.message;
      EXPECT_GT(next.clearance_m, 0);
      EXPECT_EQ(next.route.commands.back().v_W, Vec3::Zero());  // a stop at hand
      for (std::size_t n = k; n < std::min(k + 10, route.commands.size()); ++n)
        EXPECT_EQ(next.route.commands[n].p_W, route.commands[n].p_W);
      extended += next.kind == Replan::Kind::extended;
      route = std::move(next.route);
    }
    const Setpoint command = k < route.commands.size() ? route.commands[k] : route.commands.back();
    expect_continuous(last, command, options.limits.yaw.rate);
    last = command;
    loop.fly(command);
    const Vec3 p_W = loop.sample(command, {}).truth.p_W;
    contacts += distance.exact(room, p_W) <= vehicle.body.radius;
    arrived = (p_W - goal_W).norm() < 0.1 && command.v_W.isZero();
  }
  EXPECT_TRUE(arrived) << last.p_W.transpose();
  EXPECT_EQ(contacts, 0u);
  EXPECT_GT(extended, 3u);
}

/// A route through the open room, and the world before and after `change`.
struct Changed {
  std::shared_ptr<const World> before, after;
  Route route;
};
template <typename Change>
Changed changed(const Vec3& goal_W, const Change& change) {
  OccupancyGrid open({-0.1, -0.1, -0.1}, 0.1, {62, 42, 20}, Cell::occupied);
  fill(open, {0, 0, 0}, {6, 4, 1.8}, Cell::free);
  Changed c{world_of(open), nullptr, {}};
  change(open);
  c.after = world_of(open);
  const Vec3 start_W(1.05, 2.05, 0.95);
  c.route = hovering(*c.before, start_W);
  auto next = replan(*c.before, c.route, 0, 10, goal_W, {{1.0, 1.5}, 7});
  EXPECT_EQ(next.kind, Replan::Kind::extended) << next.message;
  EXPECT_TRUE(next.reaches_goal);
  c.route = std::move(next.route);
  return c;
}

TEST(Replan, KeepsARouteThatStillReachesTheGoalClear) {
  const Vec3 goal_W(5.05, 2.05, 0.95);
  const auto c = changed(goal_W, [](OccupancyGrid& g) { fill(g, {3, 0, 0}, {3.2, 0.5, 1.8}, Cell::occupied); });
  const auto next = replan(*c.after, c.route, 60, 75, goal_W, {{1.0, 1.5}, 7});
  EXPECT_EQ(next.kind, Replan::Kind::kept);
  EXPECT_EQ(next.route.commands.size(), c.route.commands.size());
}

TEST(Replan, FliesRoundAnObstacleThatAppearsAhead) {
  const Vec3 goal_W(5.05, 2.05, 0.95);
  const auto c = changed(goal_W, [](OccupancyGrid& g) { fill(g, {3.8, 1.6, 0}, {4, 2.6, 1.8}, Cell::occupied); });
  const auto next = replan(*c.after, c.route, 60, 75, goal_W, {{1.0, 1.5}, 7});
  ASSERT_EQ(next.kind, Replan::Kind::extended) << next.message;
  EXPECT_TRUE(next.reaches_goal);
  EXPECT_GT(tube_clearance(*c.after, {next.route.tube.begin() + 60, next.route.tube.end()}), 0);
  EXPECT_LT((next.route.commands[75].a_W - c.route.commands[75].a_W).norm(), 1e-9);
}

TEST(Replan, StopsOnItsPathWhereTheWayIsClosed) {
  const Vec3 goal_W(5.05, 2.05, 0.95);
  const auto c = changed(goal_W, [](OccupancyGrid& g) { fill(g, {4.5, 0, 0}, {4.7, 4, 1.8}, Cell::occupied); });
  const auto next = replan(*c.after, c.route, 60, 75, goal_W, {{1.0, 1.5}, 7});
  EXPECT_EQ(next.kind, Replan::Kind::stopping) << next.message;
  EXPECT_GT(next.clearance_m, 0);
  EXPECT_LT(next.route.commands.back().p_W.x(), 4.3);
  EXPECT_NE(next.message.find("no way"), std::string::npos) << next.message;
}

TEST(Replan, SaysThatNothingIsSafeWhereEvenTheStopIsTooLong) {
  const Vec3 goal_W(5.05, 2.05, 0.95);
  const auto c = changed(goal_W, [](OccupancyGrid&) {});
  OccupancyGrid closed = c.before->grid;
  const double x = c.route.commands[75].p_W.x() + 0.25;
  fill(closed, {x, 0, 0}, {x + 0.2, 4, 1.8}, Cell::occupied);
  const auto next = replan(*world_of(closed), c.route, 60, 75, goal_W, {{1.0, 1.5}, 7});
  EXPECT_EQ(next.kind, Replan::Kind::unsafe);
  EXPECT_LE(next.clearance_m, 0);
}

TEST(Replan, ANewPathMendsNothingOfWhatIsFlownBeforeItBegins) {
  const Vec3 goal_W(5.05, 2.05, 0.95);
  const auto c = changed(goal_W, [](OccupancyGrid&) {});
  OccupancyGrid beside = c.before->grid;
  const double x = c.route.commands[85].p_W.x();
  fill(beside, {x - 0.05, 2.2, 0}, {x + 0.05, 2.4, 1.8}, Cell::occupied);
  const auto after = world_of(beside);
  const auto from_branch = replan(*after, c.route, 130, 131, goal_W, {{1.0, 1.5}, 7});
  ASSERT_NE(from_branch.kind, Replan::Kind::unsafe) << "behind the obstacle all is well";
  const auto next = replan(*after, c.route, 60, 130, goal_W, {{1.0, 1.5}, 7});
  EXPECT_EQ(next.kind, Replan::Kind::unsafe);
  EXPECT_LE(next.clearance_m, 0);
}

TEST(Replan, WhatWasFlownAlreadyIsNoReasonToStop) {
  const Vec3 goal_W(5.05, 2.05, 0.95);
  const auto c = changed(goal_W, [](OccupancyGrid& g) { fill(g, {0.9, 1.9, 0}, {1.2, 2.2, 1.8}, Cell::occupied); });
  ASSERT_GT(c.route.commands[150].p_W.x(), 1.8);
  const auto next = replan(*c.after, c.route, 150, 165, goal_W, {{1.0, 1.5}, 7});
  EXPECT_EQ(next.kind, Replan::Kind::kept);
  EXPECT_GT(next.clearance_m, 0);
}

TEST(Replan, GoesNoFartherThanItsHorizonAtATime) {
  const auto c = changed({5.05, 2.05, 0.95}, [](OccupancyGrid&) {});
  const Vec3 start_W(1.05, 2.05, 0.95);
  const auto next = replan(*c.before, hovering(*c.before, start_W), 0, 10, {5.05, 2.05, 0.95}, {{1.0, 1.5}, 1.5});
  ASSERT_EQ(next.kind, Replan::Kind::extended) << next.message;
  EXPECT_FALSE(next.reaches_goal);
  EXPECT_LE((next.route.commands.back().p_W - start_W).norm(), 1.5 + 1e-6);
  EXPECT_GT((next.route.commands.back().p_W - start_W).norm(), 1.0);
}

TEST(Replan, KeepsTheReserveThatIsAskedForAlsoWhereTheGoalHasLess) {
  const auto c = changed({5.05, 2.05, 0.95}, [](OccupancyGrid&) {});
  const Vec3 start_W(1.05, 2.05, 0.95), goal_W(5.05, 0.45, 0.95);
  ReplanOptions options{{1.0, 1.5}, 7};
  options.reserve_m = 0.3;
  const auto next = replan(*c.before, hovering(*c.before, start_W), 0, 10, goal_W, options);
  ASSERT_EQ(next.kind, Replan::Kind::extended) << next.message;
  EXPECT_FALSE(next.reaches_goal);
  const auto& w = *c.before;
  EXPECT_GT(reach::hover_set(w.reach, w.grid, w.distance, w.bounds, next.route.commands.back().p_W).clearance, 0.3);
}

// A slot of 20 cm in a known wall, everything around it unknown.
TEST(OptimisticWay, DoesNotLeadThroughWhatIsTooNarrowForTheBody) {
  for (const bool wide : {false, true}) {
    OccupancyGrid grid = truth();
    fill(grid, {2.4, 0, 0}, {3.7, 4, 1.8}, Cell::unknown);
    fill(grid, {3, 0, 0}, {3.1, 4, 1.8}, Cell::occupied);
    fill(grid, {3, 2, 0}, {3.1, wide ? 3.0 : 2.2, 1.8}, Cell::unknown);
    const auto world = world_of(grid);
    EXPECT_EQ(optimistic_way(*world, {1.05, 2.05, 0.95}, {5.05, 2.05, 0.95}).empty(), !wide);
  }
}

TEST(PlanPromises, ATrajectoryKeepsTheLimitsAndHoversASecondAtItsGoal) {
  const auto world = world_of(truth());
  const Vec3 start_W(1.05, 1.05, 0.95), goal_W(5.05, 0.95, 0.95);
  const PlanOptions options{1.0, 1.5};
  const auto planned = plan(*world, {{start_W, Vec3::Zero()}, {start_W}}, goal_W, options);
  ASSERT_EQ(planned.status, PlanStatus::ok) << planned.message;
  ASSERT_EQ(planned.tube.size(), planned.commands.size() + 1);
  double fastest = 0, hardest = 0;
  for (const Setpoint& c : planned.commands) {
    fastest = std::max(fastest, c.v_W.cwiseAbs().maxCoeff());
    hardest = std::max(hardest, c.a_W.cwiseAbs().maxCoeff());
  }
  EXPECT_LE(fastest, 1.0 + 1e-6);
  EXPECT_LE(hardest, 1.5 + 1e-6);
  EXPECT_GT(std::max(fastest / 1.0, hardest / 1.5), 0.5) << "and is no crawl";
  for (std::size_t n = planned.commands.size() - 51; n < planned.commands.size(); ++n) {
    EXPECT_LT((planned.commands[n].p_W - goal_W).norm(), 1e-6) << n;
    EXPECT_TRUE(planned.commands[n].v_W.isZero()) << n;
  }
}

TEST(PlanPromises, ARefusedGoalIsToldByWhatIsThere) {
  OccupancyGrid grid = truth();
  fill(grid, {4, 3, 0}, {4.4, 3.4, 1.8}, Cell::unknown);
  const auto world = world_of(grid);
  const Vec3 start_W(1.05, 1.05, 0.95);
  const auto why = [&](const Vec3& goal_W) {
    const auto planned = plan(*world, {{start_W, Vec3::Zero()}, {start_W}}, goal_W, {1.0, 1.5});
    EXPECT_EQ(planned.status, PlanStatus::goal_blocked);
    return planned.message;
  };
  EXPECT_NE(why({4.15, 3.15, 0.95}).find("is unknown space"), std::string::npos);
  EXPECT_NE(why({3.05, 1, 0.95}).find("is occupied"), std::string::npos);
  EXPECT_NE(why({9, 1, 0.95}).find("is outside the map"), std::string::npos);
  EXPECT_NE(why({5.05, 0.2, 0.95}).find("is not clear"), std::string::npos);

  // Beside a wall whose wash no loop holds against.
  Model stormy;
  stormy.ground.l_max = stormy.ground.l_footprint_max = stormy.corner.l_max = stormy.wall.l_max = 0.6;
  stormy.wall.k1 = {3000, 3000, 3000};
  const auto storm = build_world(grid, stormy, config::load_vehicle("builtin:quad-5in").value());
  const auto planned = plan(*storm, {{start_W, Vec3::Zero()}, {start_W}}, {5.05, 0.35, 0.95}, {1.0, 1.5});
  EXPECT_EQ(planned.status, PlanStatus::goal_blocked);
  EXPECT_NE(planned.message.find("has no bound"), std::string::npos) << planned.message;
}

}  // namespace
}  // namespace backwash::plan
