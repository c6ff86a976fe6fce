// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "core/config/config.hpp"
#include "core/plan/planner.hpp"
#include "core/reach/clearance.hpp"
#include "core/types/minimum_jerk.hpp"
#include "tests/plan/drawn.hpp"

namespace backwash::plan {
namespace {

using map::Cell;
using map::OccupancyGrid;

/// The default model with short ranges (worlds build fast) and stronger walls.
Model short_ranged_model() {
  Model m;
  m.ground.l_max = m.ground.l_footprint_max = m.corner.l_max = m.wall.l_max = 0.5;
  m.wall.k1 = {1.0, 0.4, 0.4};
  return m;
}

/// Free room 0…6 × 0…4 × 0…1.6 m, walled on all sides, with a 0.1 m wall at x = 3 that leaves y > gap_from open.
OccupancyGrid room(double gap_from) {
  OccupancyGrid grid({-0.1, -0.1, -0.1}, 0.1, {62, 42, 18}, Cell::occupied);
  fill(grid, {0, 0, 0}, {6, 4, 1.6}, Cell::free);
  if (gap_from > 0) fill(grid, {3, 0, 0}, {3.1, gap_from, 1.6}, Cell::occupied);
  return grid;
}

const World& gap_world() {
  static const auto world = build_world(room(2.8), short_ranged_model(), test_vehicle());
  return *world;
}
const World& closed_world() {
  static const auto world = build_world(room(4.0), short_ranged_model(), test_vehicle());
  return *world;
}

PlanStart at_rest(const Vec3& p) { return {{p, Vec3::Zero()}, {p, Vec3::Zero(), Vec3::Zero(), 0}}; }

/// A set of half width `half` that stays at p for `steps` steps.
reach::ReachTube still_tube(const Vec3& p, std::size_t steps, double half) {
  reach::ReachTube tube;
  PerDirection widths;
  widths.fill(half);
  for (std::size_t k = 0; k < steps; ++k)
    tube.push_back({static_cast<double>(k) * kControlPeriod, {p, Vec3::Zero()}, {}, widths, widths, Mat3::Zero(), 0});
  return tube;
}

const Vec3 kStart(1.03, 1.02, 0.81), kGoal(5.01, 0.97, 0.83);

/// Everything that an accepted plan promises, checked on its own samples.
void expect_sound(const World& world, const Plan& p, const PlanStart& start, const Vec3& goal, const PlanOptions& o) {
  ASSERT_EQ(p.status, PlanStatus::ok) << p.message;
  EXPECT_EQ(p.tube.size(), p.commands.size() + 1);
  EXPECT_LT((p.commands.front().p_W - start.command.p_W).norm(), 1e-9);
  EXPECT_LT((p.commands.front().v_W - start.command.v_W).norm(), 1e-9);
  EXPECT_LT((p.commands.back().p_W - goal).norm(), 1e-9);
  EXPECT_EQ(p.commands.back().v_W, Vec3::Zero());
  for (double t = 0; t <= p.trajectory.duration(); t += 0.003) {
    EXPECT_LE(p.trajectory.derivative(t, 1).cwiseAbs().maxCoeff(), o.v_max * (1 + 1e-9));
    EXPECT_LE(p.trajectory.derivative(t, 2).cwiseAbs().maxCoeff(), o.a_max * (1 + 1e-9));
  }
  // The box of each set, grown by the body as a box of half its edge, meets no voxel that is not free: brute force.
  const double body = (world.reach.vehicle.body.radius + world.reach.vehicle.estimation.position) / std::sqrt(3.0);
  double least = INFINITY;
  for (const auto& step : p.tube) {
    const auto& h = step.half_widths;
    const Vec3 half = Vec3(h[kX], h[kY], h[kZ]) + Vec3::Constant(body);
    const Index3 low = world.grid.index(step.center.p_W - half), high = world.grid.index(step.center.p_W + half);
    for (int x = low.x(); x <= high.x(); ++x)
      for (int y = low.y(); y <= high.y(); ++y)
        for (int z = low.z(); z <= high.z(); ++z) {
          // The horizontal set is the octagon: corners of the box beyond it do not count.
          const Vec3 d = (world.grid.center({x, y, z}) - step.center.p_W).cwiseAbs();
          const double diagonal = std::max(h[kXyPlus], h[kXyMinus]) + body * std::sqrt(2.0);
          if ((d.x() + d.y() - 0.1) / std::sqrt(2.0) > diagonal) continue;
          EXPECT_TRUE(world.grid.free({x, y, z})) << step.t;
        }
    least = std::min(least, world.distance.exact(world.grid, step.center.p_W));
  }
  EXPECT_GT(p.metrics.min_clearance_m, 0);
  EXPECT_LE(p.metrics.min_clearance_m,
            least - world.reach.vehicle.body.radius - world.reach.vehicle.estimation.position);
  EXPECT_NEAR(p.metrics.min_clearance_m, tube_clearance(world, p.tube), 1e-9);
}

TEST(Plan, GoesRoundAThinWallToItsFarGapAtEverySpeed) {
  for (const double v_max : {0.3, 0.5, 1.0, 1.5, 2.0, 3.0}) {
    const PlanOptions options{v_max, 2.0};
    const Plan p = plan(gap_world(), at_rest(kStart), kGoal, options);
    SCOPED_TRACE(v_max);
    expect_sound(gap_world(), p, at_rest(kStart), kGoal, options);
    for (const auto& step : p.tube) {
      const Vec3& c = step.center.p_W;
      EXPECT_TRUE(std::abs(c.x() - 3.05) > 0.1 || c.y() > 2.8 + 0.18) << c.transpose();
    }
  }
}

TEST(Plan, ReportsLengthTimeAndJerkOfItsOwnTrajectory) {
  const Plan p = plan(gap_world(), at_rest(kStart), kGoal, {1.5, 2});
  ASSERT_EQ(p.status, PlanStatus::ok) << p.message;
  double length = 0, jerk2 = 0;
  const double step = 1e-3;
  for (double t = step / 2; t < p.trajectory.duration(); t += step) {
    length += p.trajectory.derivative(t, 1).norm() * step;
    jerk2 += p.trajectory.derivative(t, 3).squaredNorm() * step;
  }
  EXPECT_NEAR(p.metrics.length_m, length, 1e-2 * length);
  EXPECT_NEAR(p.metrics.jerk2, jerk2, 1e-2 * jerk2);
  EXPECT_NEAR(p.metrics.time_s, p.trajectory.duration(), 1e-12);
  EXPECT_GT(p.metrics.length_m, 2 * std::hypot(2.0, 1.9));  // round the end of the wall
}

TEST(Plan, FromMotionContinuesTheCommand) {
  PlanStart start = at_rest(kStart);
  start.command.v_W = {0.6, 0.4, 0};
  start.command.a_W = {0.3, -0.2, 0.1};
  start.estimated = {kStart + Vec3(-0.02, 0.01, 0.01), {0.55, 0.42, 0.02}};
  const Plan p = plan(gap_world(), start, kGoal, {1.5, 2});
  expect_sound(gap_world(), p, start, kGoal, {1.5, 2});
  EXPECT_LT((p.commands.front().a_W - start.command.a_W).norm(), 1e-9);
  EXPECT_EQ(p.tube.front().center.p_W, start.estimated.p_W);
}

TEST(Plan, FromAboveTheLimitSlowsDown) {
  PlanStart start = at_rest({1.0, 3.2, 0.8});
  start.command.v_W = start.estimated.v_W = {1.2, 0, 0};
  const Plan p = plan(gap_world(), start, {5, 3.2, 0.8}, {0.8, 2});
  ASSERT_EQ(p.status, PlanStatus::ok) << p.message;
  for (double t = 0; t <= p.trajectory.duration(); t += 0.003) {
    EXPECT_LE(p.trajectory.derivative(t, 1).x(), 1.2 + 1e-9);
    EXPECT_LE(p.trajectory.derivative(t, 1).tail<2>().cwiseAbs().maxCoeff(), 0.8 + 1e-9);
  }
}

TEST(Plan, SaysNoPathBehindAClosedWall) {
  const Plan p = plan(closed_world(), at_rest(kStart), kGoal, {1.5, 2});
  EXPECT_EQ(p.status, PlanStatus::no_path);
  EXPECT_FALSE(p.message.empty());
  EXPECT_TRUE(p.commands.empty());
}

TEST(Plan, SaysWhereAndWhyAStartOrGoalIsBlocked) {
  const World& world = gap_world();
  const auto status = [&](const Vec3& from, const Vec3& to) { return plan(world, at_rest(from), to, {1.5, 2}); };
  const Plan occupied = status({3.05, 1, 0.8}, kGoal), outside = status(kStart, {9, 1, 0.8}),
             near_wall = status(kStart, {2.85, 1, 0.8}), not_finite = status(kStart, {NAN, 1, 0.8});
  EXPECT_EQ(occupied.status, PlanStatus::start_blocked);
  EXPECT_NE(occupied.message.find("(3.05, 1.00, 0.80) is occupied"), std::string::npos) << occupied.message;
  EXPECT_EQ(outside.status, PlanStatus::goal_blocked);
  EXPECT_NE(outside.message.find("outside the map"), std::string::npos) << outside.message;
  EXPECT_EQ(near_wall.status, PlanStatus::goal_blocked);
  EXPECT_NE(near_wall.message.find("clear"), std::string::npos) << near_wall.message;
  EXPECT_EQ(not_finite.status, PlanStatus::goal_blocked);
}

TEST(Plan, KeepsItsDeadline) {
  const Plan p = plan(gap_world(), at_rest(kStart), kGoal, {0.3, 2, 0.0});
  EXPECT_EQ(p.status, PlanStatus::deadline);
  EXPECT_TRUE(p.commands.empty());
}

TEST(Plan, KeepsAConstantMarginFromEverything) {
  const auto world = build_world(room(2.8), short_ranged_model(), test_vehicle(), reach::Method::tight, 0.2);
  const Plan p = plan(*world, at_rest(kStart), kGoal, {1.5, 2});
  ASSERT_EQ(p.status, PlanStatus::ok) << p.message;
  for (const auto& step : p.tube)
    EXPECT_GT(world->distance.exact(world->grid, step.center.p_W), 0.16 + 0.02 + 0.2 - 1e-9);
  // In a gap narrower than twice body, estimation and margin there is no way.
  const auto narrow = build_world(room(3.3), short_ranged_model(), test_vehicle(), reach::Method::tight, 0.2);
  EXPECT_EQ(plan(*narrow, at_rest(kStart), kGoal, {1.5, 2}).status, PlanStatus::no_path);
}

TEST(Plan, SaysThatTheStartIsBlockedWhereTheVehicleItselfIsNotClear) {
  // The command is at a clear place; the vehicle has been pushed beside the wall at x = 3.
  PlanStart start = at_rest({2.6, 1, 0.8});
  ASSERT_EQ(plan(gap_world(), start, {1, 1, 0.8}, {1.5, 2}).status, PlanStatus::ok);
  start.estimated.p_W.x() = 2.83;
  const Plan p = plan(gap_world(), start, {1, 1, 0.8}, {1.5, 2});
  EXPECT_EQ(p.status, PlanStatus::start_blocked);
  EXPECT_NE(p.message.find("(2.83, 1.00, 0.80), where the vehicle is now, is not clear"), std::string::npos)
      << p.message;
  EXPECT_EQ(p.metrics.expanded, 0u);
}

TEST(NearestApproach, FindsTheOneStepThatTouches) {
  const World& world = gap_world();
  reach::ReachTube tube = still_tube({1.5, 2, 0.8}, 100, 0.05);
  EXPECT_NEAR(tube_clearance(world, tube), 0.8 - 0.05 - 0.18, 1e-6);  // floor and ceiling
  tube[60].half_widths_interval[kZ] = 0.65;
  const Approach nearest = nearest_approach(world, tube);
  EXPECT_LT(nearest.clearance, 0);
  EXPECT_NEAR(nearest.t, 1.2, 1e-12);
}

// Steps are looked at together and left out by bounds: against every step by itself, on flights that turn and widen.
TEST(NearestApproach, IsTheLeastOfAllSteps) {
  const World& world = gap_world();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  int touching = 0;
  for (int draw = 0; draw < 300; ++draw) {
    const Vec3 middle(0.5 + 5 * unit(random), 0.5 + 3 * unit(random), 0.4 + 0.8 * unit(random));
    const double turn = 8 * unit(random), reach = 0.5 * unit(random), widest = 0.5 * unit(random);
    reach::ReachTube tube;
    for (std::size_t k = 0; k < 70; ++k) {
      const double t = 0.02 * static_cast<double>(k);
      const Vec3 p = middle + reach * Vec3(std::cos(turn * t), std::sin(turn * t), std::sin(3 * turn * t));
      PerDirection h;
      for (double& half : h) half = widest * (0.7 + 0.3 * unit(random));
      h[kZ] *= 0.3;
      tube.push_back({t, {p, Vec3::Zero()}, {}, h, h, Mat3::Zero(), 0});
    }
    double least = 2 + reach::body_and_estimation(world.reach.vehicle);
    for (std::size_t k = 0; k < tube.size(); ++k)
      least = std::min(least, reach::swept_prism_distance(world.grid, tube[k].center.p_W,
                                                          tube[std::min(k + 1, tube.size() - 1)].center.p_W,
                                                          tube[k].half_widths_interval, least));
    const double clearance = least - reach::body_and_estimation(world.reach.vehicle);
    touching += clearance <= 0;
    EXPECT_NEAR(nearest_approach(world, tube).clearance, clearance, 1e-9) << draw;
  }
  EXPECT_GT(touching, 20);
  EXPECT_LT(touching, 280);
}

TEST(NearestApproach, WhatIsNoNumberIsNotClear) {
  for (const std::size_t k : {0u, 8u, 39u}) {
    reach::ReachTube width = still_tube({1.5, 2, 0.8}, 40, 0.05), place = width;
    width[k].half_widths_interval[kX] = NAN;
    place[k].center.p_W.y() = NAN;
    EXPECT_LT(nearest_approach(gap_world(), width).clearance, 0) << k;
    EXPECT_LT(nearest_approach(gap_world(), place).clearance, 0) << k;
  }
}

TEST(TakeoffColumn, FindsTheFloorAndTheLowestClearHover) {
  const World& world = gap_world();
  const auto column = takeoff_column(world, {1.5, 1.5, 0.3}, 0);
  ASSERT_TRUE(column);
  EXPECT_NEAR(column->z_floor, 0, 1e-9);
  EXPECT_GT(column->z_safe, 0.18);
  const auto safe = [&](double z) {
    return reach::hover_set(world.reach, world.grid, world.distance, world.bounds, {1.5, 1.5, z}).safe();
  };
  EXPECT_TRUE(safe(column->z_safe));
  EXPECT_FALSE(safe(column->z_safe - 0.1));
  EXPECT_FALSE(takeoff_column(world, {3.05, 1, 0.8}, 0));  // in the wall
  EXPECT_FALSE(takeoff_column(world, {2.9, 1, 0.8}, 0));   // too near to it at any height
}

TEST(VerticalCommands, RestToRestWithinTheLimits) {
  const Vec3 from(1, 2, 0.1), to(1, 2, 1.3);
  for (const double v_max : {0.2, 5.0}) {
    const auto commands = rest_to_rest(from, to, v_max, 1.0);
    EXPECT_EQ(commands.front().p_W, from);
    EXPECT_LT((commands.back().p_W - to).norm(), 1e-12);
    EXPECT_LT(commands.back().v_W.norm() + commands.back().a_W.norm() + commands.front().a_W.norm(), 1e-12);
    double v_peak = 0, a_peak = 0;
    for (std::size_t k = 1; k + 1 < commands.size(); ++k) {
      v_peak = std::max(v_peak, std::abs(commands[k].v_W.z()));
      a_peak = std::max(a_peak, std::abs(commands[k].a_W.z()));
      const double slope = (commands[k + 1].p_W.z() - commands[k - 1].p_W.z()) / 0.04;
      EXPECT_NEAR(commands[k].v_W.z(), slope, 5e-3);
      EXPECT_NEAR(commands[k].a_W.z(), (commands[k + 1].v_W.z() - commands[k - 1].v_W.z()) / 0.04, 2e-2);
    }
    EXPECT_LE(v_peak, v_max * (1 + 1e-9));
    EXPECT_LE(a_peak, 1 + 1e-9);
    EXPECT_GT(std::max(v_peak / v_max, a_peak), 0.95);  // no slower than needed
  }
}

TEST(Plan, HoldsAStatedRiskWhereTheWorstCaseFindsNoWay) {
  Vehicle vehicle = test_vehicle();
  vehicle.controller = {{1.71, 1.71}, {1.8, 1.8}, 0.02, 0, 0.1};  // PX4's own defaults
  for (const double gap_from : {2.4, 2.8}) {
    const auto with = [&](const Model& model) {
      return plan(*build_world(room(gap_from), model, vehicle), at_rest(kStart), kGoal, {.v_max = 1.5, .a_max = 2});
    };
    EXPECT_NE(with({}).status, PlanStatus::ok);
    for (const double risk : {1e-2, 1e-3}) {
      const Plan p = with(model_for({}, vehicle, risk));
      ASSERT_EQ(p.status, PlanStatus::ok) << p.message;
      EXPECT_GT(p.metrics.risk.total, 0) << "a plan may keep wider than its risk asks, and does";
      EXPECT_LE(p.metrics.risk.total, risk);
    }
    // What is verified holds the risk, not the sets that it was looked for with.
    Model looked_for_with_more = model_for({}, vehicle, 1e-2);
    looked_for_with_more.bound.stated->touch = 1e-9;
    const Plan refused = with(looked_for_with_more);
    EXPECT_EQ(refused.status, PlanStatus::infeasible);
    EXPECT_NE(refused.message.find("the risk of touching is"), std::string::npos) << refused.message;
    Model narrow;  // its worst case is less than what the risk asks for
    narrow.bound.kappa = 0.5;
    EXPECT_THROW(model_for(narrow, vehicle, 1e-3), std::invalid_argument);
  }
}

// The clearance of tubes that the planner's verification rests on: against the prism queries of core/reach step by
// step, and in closed form beside a pillar.

using map::Cell;
using map::OccupancyGrid;

const Vehicle& vehicle() {
  static const Vehicle v = config::load_vehicle("builtin:quad-5in").value();
  return v;
}
double body() { return vehicle().body.radius + vehicle().estimation.position; }

/// 4 × 4 × 2 m of free space at 0.1 m; outside it nothing is known.
OccupancyGrid open_room() { return {Vec3::Zero(), 0.1, {40, 40, 20}, Cell::free}; }
void fill_voxels(OccupancyGrid& grid, const Index3& low, const Index3& high, Cell cell = Cell::occupied) {
  for (int k = low.z(); k <= high.z(); ++k)
    for (int j = low.y(); j <= high.y(); ++j)
      for (int i = low.x(); i <= high.x(); ++i) grid.set({i, j, k}, cell);
}
std::shared_ptr<const World> world_around(OccupancyGrid grid, std::optional<double> margin = std::nullopt) {
  return build_world(std::move(grid), Model{}, vehicle(), reach::Method::tight, margin);
}

/// Sets of one half width, whose instants are far smaller than their intervals.
reach::ReachTube tube_along(const std::vector<Vec3>& centers, double half_width = 0.05) {
  reach::ReachTube tube(centers.size());
  for (std::size_t k = 0; k < tube.size(); ++k) {
    tube[k].t = static_cast<double>(k) * kControlPeriod;
    tube[k].center.p_W = centers[k];
    tube[k].half_widths.fill(0.01);
    tube[k].half_widths_interval.fill(half_width);
    tube[k].half_widths_interval[kXyPlus] = tube[k].half_widths_interval[kXyMinus] = half_width * std::sqrt(2.0);
  }
  return tube;
}

/// Random flights through random clutter; the clearance of each step taken by itself, without a limit.
void expect_equal_to_each_step_by_itself(std::optional<double> margin) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> u(0, 1);
  OccupancyGrid grid = open_room();
  for (int n = 0; n < 60; ++n)
    grid.set(grid.index({4 * u(random), 4 * u(random), 2 * u(random)}),
             u(random) < 0.5 ? Cell::occupied : Cell::unknown);
  const auto world = world_around(grid, margin);
  int positive = 0;
  for (int flight = 0; flight < 60; ++flight) {
    Vec3 p(0.5 + 3 * u(random), 0.5 + 3 * u(random), 0.4 + 1.2 * u(random));
    const Vec3 step = 0.1 * Vec3(u(random) - 0.5, u(random) - 0.5, 0.3 * (u(random) - 0.5));
    std::vector<Vec3> centers;
    for (int k = 0; k < 25; ++k, p += step) centers.push_back(p);
    auto tube = tube_along(centers, 0.02 + 0.1 * u(random));
    for (auto& s : tube) s.half_widths_interval[kZ] *= 0.3 + u(random);
    double expected = 2.0;
    for (std::size_t k = 0; k < tube.size(); ++k) {
      const PerDirection h = margin ? PerDirection{} : tube[k].half_widths_interval;
      const Vec3& to = tube[std::min(k + 1, tube.size() - 1)].center.p_W;
      expected = std::min(
          expected, reach::swept_prism_distance(grid, tube[k].center.p_W, to, h, 9.0) - body() - margin.value_or(0.0));
    }
    EXPECT_NEAR(tube_clearance(*world, tube), expected, 1e-9) << flight;
    positive += expected > 0;
  }
  EXPECT_GT(positive, 10);
  EXPECT_LT(positive, 55);
}

TEST(TubeClearance, IsTheLeastOfItsStepsEachTakenByItself) { expect_equal_to_each_step_by_itself({}); }
TEST(TubeClearance, WithAConstantMarginIsTheLeastOfItsStepsToo) { expect_equal_to_each_step_by_itself(0.1); }

/// A pillar whose near face is at x = 2.5, in the given layers.
OccupancyGrid pillar(int lowest, int highest) {
  OccupancyGrid grid = open_room();
  fill_voxels(grid, {25, 19, lowest}, {26, 20, highest});
  return grid;
}

TEST(LateralClearance, BesideAPillarIsTheGapLessSetBodyAndEstimation) {
  const auto world = world_around(pillar(0, 19));
  const auto at = [&](double x, double half_width) {
    return lateral_clearance(*world, tube_along({{x, 2, 0.6}, {x, 2, 0.6}}, half_width));
  };
  EXPECT_NEAR(at(1.6, 0.05), 0.9 - 0.05 - body(), 1e-9);
  EXPECT_NEAR(at(1.6, 0.2), 0.9 - 0.2 - body(), 1e-9);
  EXPECT_NEAR(lateral_clearance(*world, tube_along({{1.6, 2, 0.6}, {1.7, 2, 0.6}})), 0.8 - 0.05 - body(), 1e-9)
      << "the set is swept to the next one";
  // Past the pillar at x = 2.3 in one step, neither end nor the middle of which is beside it.
  EXPECT_NEAR(lateral_clearance(*world, tube_along({{2.3, 0.8, 0.6}, {2.3, 2.5, 0.6}})), 0.2 - 0.05 - body(), 1e-9);
  const auto with_margin = world_around(pillar(0, 19), 0.3);
  EXPECT_NEAR(lateral_clearance(*with_margin, tube_along({{1.6, 2, 0.6}, {1.6, 2, 0.6}})), 0.9 - 0.3 - body(), 1e-9);
}

TEST(LateralClearance, CountsTheLayersBesideBodyAndSetAndNoOthers) {
  // The body's upper edge at 0.6 + 0.05 + 0.18 = 0.83 m: layer 8.
  const auto tube = tube_along({{1.6, 2, 0.6}, {1.6, 2, 0.6}});
  const double beside = 0.9 - 0.05 - body();
  for (const int layer : {4, 6, 8})
    EXPECT_NEAR(lateral_clearance(*world_around(pillar(layer, layer)), tube), beside, 1e-9);
  for (const int layer : {2, 9, 12}) EXPECT_NEAR(lateral_clearance(*world_around(pillar(layer, layer)), tube), 1, 1e-9);
}

TEST(LateralClearance, IsThatOfTouchingWhereTheCentreIsNotInFreeSpace) {
  for (const Cell cell : {Cell::occupied, Cell::unknown}) {
    OccupancyGrid grid = open_room();
    fill_voxels(grid, {16, 20, 10}, {16, 20, 10}, cell);
    const auto tube = tube_along({{1.65, 2.05, 0.6}, {1.65, 2.05, 1.05}, {1.65, 2.05, 1.05}});
    EXPECT_NEAR(lateral_clearance(*world_around(grid), tube), -body(), 1e-9);
  }
}

TEST(TakeoffClearance, IsBesideItBelowTheSafeHeightAndAllAroundAboveIt) {
  std::vector<Vec3> up;
  for (int k = 0; k <= 20; ++k) up.emplace_back(1.5, 2, 0.2 + 0.05 * k);  // to 1.2 m
  const auto tube = tube_along(up, 0.05);
  OccupancyGrid low = open_room();
  fill_voxels(low, {19, 20, 0}, {19, 20, 3});  // beside it, below the safe height
  // The last set below it, swept up to the next, is beside the pillar; above it the pillar's top is farther away.
  EXPECT_NEAR(takeoff_clearance(*world_around(low), tube, 0.63), 0.4 - 0.05 - body(), 1e-9);
  OccupancyGrid ceiling = open_room();
  fill_voxels(ceiling, {13, 18, 16}, {17, 22, 16});
  EXPECT_NEAR(takeoff_clearance(*world_around(ceiling), tube, 0.53), 1.6 - 1.2 - 0.05 - body(), 1e-9);
  EXPECT_NEAR(takeoff_clearance(*world_around(ceiling), tube_along({up.begin(), up.begin() + 5}), 0.53),
              0.4 - 0.05 - body(), 1e-9)
      << "a place of rest is not excused its floor";
}

TEST(TakeoffColumn, IsTheSameFromEveryHeightAboveItsFloor) {
  OccupancyGrid grid = open_room();
  fill_voxels(grid, {0, 0, 0}, {39, 39, 2});  // the floor's top at 0.3 m
  const auto world = world_around(grid);
  const auto lowest = takeoff_column(*world, {1.5, 2, 0.35}, 0);
  ASSERT_TRUE(lowest);
  EXPECT_NEAR(lowest->z_floor, 0.3, 1e-9);
  for (const double z : {0.7, 1.1, 1.6}) {
    const auto column = takeoff_column(*world, {1.5, 2, z}, 0);
    ASSERT_TRUE(column) << z;
    EXPECT_NEAR(column->z_floor, 0.3, 1e-9);
    EXPECT_NEAR(column->z_safe, lowest->z_safe, 1e-9);
  }
}

}  // namespace
}  // namespace backwash::plan
