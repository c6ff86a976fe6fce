// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "core/plan/bspline_optimizer.hpp"

namespace backwash::plan {
namespace {

using map::Cell;
using map::OccupancyGrid;

Vehicle test_vehicle(double latency, double attitude_lag, double feedback_delay = 0) {
  Vehicle v;
  v.body = {0.16, 0.18, 0.0635, 0.9};
  v.controller = {{10, 12}, {5.5, 6}, latency, feedback_delay, attitude_lag};
  v.estimation.position = 0.02;
  v.limits = {1.5, 2};
  v.initial_error = {0.02, 0.05};
  return v;
}

Vec3 random_vector(std::mt19937& random, double size) {
  std::uniform_real_distribution<double> u(-size, size);
  return {u(random), u(random), u(random)};
}

TEST(CentreAdjoint, EqualsFiniteDifferencesOfThePrediction) {
  std::mt19937 random(1);
  for (const Vehicle& vehicle : {test_vehicle(0, 0), test_vehicle(0.02, 0.05), test_vehicle(0.033, 0.08),
                                 test_vehicle(0.1, 0), test_vehicle(0.02, 0.05, 0.015)}) {
    const std::size_t n = 60;
    std::vector<Setpoint> commands(n);
    for (auto& c : commands) c = {random_vector(random, 1), random_vector(random, 1), random_vector(random, 1), 0};
    std::vector<Vec3> by_p(n), by_v(n);
    for (std::size_t k = 0; k < n; ++k) by_p[k] = random_vector(random, 1), by_v[k] = random_vector(random, 1);
    const auto value = [&] {
      reach::CentrePredictor centre(vehicle, reach::Loop::vehicle, {Vec3(1, 2, 3), Vec3(0.1, 0, 0)}, {0, 0.5, 0}, {});
      double f = 0;
      for (std::size_t k = 0; k < n; ++k) {
        const State s = centre.step(commands[k]);
        f += by_p[k].dot(s.p_W) + by_v[k].dot(s.v_W);
      }
      return f;
    };
    const auto gradient = CentreAdjoint(vehicle, reach::Loop::vehicle).pull_back(by_p, by_v);
    for (const std::size_t k : {0u, 1u, 7u, 30u, 55u, 58u, 59u})
      for (int axis = 0; axis < 3; ++axis) {
        const auto slope = [&](double& x) {  // f is linear: a wide difference has no truncation error
          const double x0 = x;
          x = x0 + 1;
          const double up = value();
          x = x0 - 1;
          const double down = value();
          x = x0;
          return (up - down) / 2;
        };
        EXPECT_NEAR(gradient.p[k][axis], slope(commands[k].p_W[axis]), 1e-6) << vehicle.controller.latency << " " << k;
        EXPECT_NEAR(gradient.v[k][axis], slope(commands[k].v_W[axis]), 1e-6);
        EXPECT_NEAR(gradient.a[k][axis], slope(commands[k].a_W[axis]), 1e-6);
      }
  }
}

/// Corridor-like scene and a wavy spline that comes too near to a block and breaks both limits somewhere.
struct Scene {
  OccupancyGrid grid{{0, 0, 0}, 0.1, {60, 30, 20}, Cell::free};
  map::DistanceField distance = field();
  Vehicle vehicle = test_vehicle(0.02, 0.05);
  PlanStart start{{Vec3(1.02, 1.51, 1.03), Vec3(0.1, 0, 0)}, {Vec3(1, 1.5, 1), Vec3(0.2, 0, 0), Vec3::Zero(), 0}};

  map::DistanceField field() {
    for (int i = 25; i < 32; ++i)
      for (int j = 0; j < 13; ++j)
        for (int k = 0; k < 20; ++k) grid.set({i, j, k}, Cell::occupied);
    return map::DistanceField(grid);
  }
  BSpline spline(unsigned seed) const {
    std::mt19937 random(seed);
    std::vector<Vec3> samples;
    for (int i = 0; i <= 14; ++i) samples.push_back(Vec3(1 + 4.0 * i / 14, 1.55, 1) + random_vector(random, 0.05));
    samples.front() = start.command.p_W;
    return fit(samples, 0.25, start.command.v_W, start.command.a_W, Vec3::Zero(), Vec3::Zero());
  }
  SplineCost cost(const BSpline& s, double keep_away, const CostWeights& weights) const {
    const std::vector<double> r(s.commands().size() + 50 + 1, keep_away);
    return {distance, vehicle, reach::Loop::vehicle, start, s, r, Vec3::Constant(0.9), Vec3::Constant(1.2), weights};
  }
};

void expect_exact_gradient(const SplineCost& cost) {
  std::vector<double> x = cost.start_point();
  const auto value = cost(x);
  double largest = 0;
  for (const double g : value.gradient) largest = std::max(largest, std::abs(g));
  ASSERT_GT(value.f, 0);
  ASSERT_GT(largest, 0);
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double x0 = x[i], step = 1e-6;
    x[i] = x0 + step;
    const double up = cost(x).f;
    x[i] = x0 - step;
    const double down = cost(x).f;
    x[i] = x0;
    EXPECT_NEAR(value.gradient[i], (up - down) / (2 * step), 2e-5 * largest) << i;
  }
}

TEST(SplineCost, GradientOfTheSmoothnessEqualsFiniteDifferences) {
  const Scene scene;
  expect_exact_gradient(scene.cost(scene.spline(1), 0.4, {1, 0, 0}));
}
TEST(SplineCost, GradientOfTheCollisionCostEqualsFiniteDifferences) {
  const Scene scene;
  for (const unsigned seed : {2u, 3u, 4u}) expect_exact_gradient(scene.cost(scene.spline(seed), 0.4, {0, 1, 0}));
}
TEST(SplineCost, GradientOfTheLimitsEqualsFiniteDifferences) {
  const Scene scene;
  expect_exact_gradient(scene.cost(scene.spline(5), 0.4, {0, 0, 1}));
}

TEST(SplineCost, IsTheWeightedSumOfTheModelsTerms) {
  // Literal sums over the predicted motion and the control points, written out again.
  const Scene scene;
  const BSpline spline = scene.spline(6);
  const auto value = [&](const CostWeights& w) {
    const auto cost = scene.cost(spline, 0.4, w);
    return cost(cost.start_point()).f;
  };
  const auto& q = spline.control_points;
  double smooth = 0, physical = 0, collision = 0;
  for (std::size_t i = 0; i + 3 < q.size(); ++i)
    smooth += (-q[i] + 3 * q[i + 1] - 3 * q[i + 2] + q[i + 3]).squaredNorm();
  const auto beyond = [&](const Vec3& x, double limit) {
    for (int axis = 0; axis < 3; ++axis)
      if (std::abs(x[axis]) > limit) physical += std::pow(x[axis] * x[axis] - limit * limit, 2);
  };
  for (std::size_t i = 0; i + 1 < q.size(); ++i) beyond((q[i + 1] - q[i]) / 0.25, 0.9);
  for (std::size_t i = 0; i + 2 < q.size(); ++i) beyond((q[i + 2] - 2 * q[i + 1] + q[i]) / 0.0625, 1.2);
  auto commands = spline.commands();
  commands.insert(commands.end(), 50, Setpoint(commands.back()));
  reach::CentrePredictor centre(scene.vehicle, reach::Loop::vehicle, scene.start.estimated, Vec3::Zero(),
                                scene.start.command);
  for (const auto& c : commands) {
    const State s = centre.step(c);
    const double d = scene.distance.interpolated(s.p_W);
    if (d <= 0.4) collision += (d - 0.4) * (d - 0.4) * s.v_W.norm() * 0.02;
  }
  ASSERT_GT(collision, 0);
  ASSERT_GT(physical, 0);
  EXPECT_NEAR(value({1, 0, 0}), smooth, 1e-9 * smooth);
  EXPECT_NEAR(value({0, 1, 0}), collision, 1e-9 * collision);
  EXPECT_NEAR(value({0, 0, 1}), physical, 1e-9 * physical);
  EXPECT_NEAR(value({2, 3, 4}), 2 * smooth + 3 * collision + 4 * physical, 1e-6);
}

TEST(Optimise, LeavesTheForbiddenDistanceAndKeepsTheEnds) {
  const Scene scene;
  const BSpline spline = scene.spline(7);
  const auto cost = scene.cost(spline, 0.4, {1, 2000, 0});
  const auto before = cost(cost.start_point());
  const auto result = optimise(cost, 200, Clock::now() + std::chrono::seconds(5));
  EXPECT_LT(result.cost, 0.1 * before.f);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(result.spline.control_points[i], spline.control_points[i]);
    EXPECT_EQ(*(result.spline.control_points.end() - 1 - static_cast<std::ptrdiff_t>(i)),
              *(spline.control_points.end() - 1 - static_cast<std::ptrdiff_t>(i)));
  }
  double nearest = INFINITY;
  for (const auto& c : result.spline.commands()) nearest = std::min(nearest, scene.distance.exact(scene.grid, c.p_W));
  EXPECT_GT(nearest, 0.35);
}

TEST(Optimise, ReturnsTheStartWhenTheDeadlineHasPassed) {
  const Scene scene;
  const BSpline spline = scene.spline(8);
  const auto result = optimise(scene.cost(spline, 0.4, {}), 200, Clock::now());
  for (std::size_t i = 0; i < spline.control_points.size(); ++i)
    EXPECT_EQ(result.spline.control_points[i], spline.control_points[i]);
}

}  // namespace
}  // namespace backwash::plan
