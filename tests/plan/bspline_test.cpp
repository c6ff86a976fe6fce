// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "core/plan/planner.hpp"
#include "core/plan/spline/bspline.hpp"
#include "core/plan/spline/bspline_optimizer.hpp"
#include "tests/plan/drawn.hpp"

namespace backwash::plan {
namespace {

BSpline random_spline(std::mt19937& random, std::size_t control_points, double knot_span) {
  BSpline spline{{}, knot_span};
  for (std::size_t i = 0; i < control_points; ++i) spline.control_points.push_back(random_vector(random, 1));
  return spline;
}

/// Cox–de Boor recursion on uniform knots: an independent definition of the basis.
double basis(int i, int degree, double s) {
  if (degree == 0) return s >= i && s < i + 1 ? 1 : 0;
  return (s - i) / degree * basis(i, degree - 1, s) + (i + degree + 1 - s) / degree * basis(i + 1, degree - 1, s);
}

TEST(BSpline, EqualsTheCoxDeBoorRecursion) {
  std::mt19937 random(1);
  const BSpline spline = random_spline(random, 9, 0.3);
  for (double t = 0; t < spline.duration(); t += 0.0173) {
    Vec3 p = Vec3::Zero();
    for (int i = 0; i < 9; ++i) p += basis(i, 3, t / 0.3 + 3) * spline.control_points[static_cast<std::size_t>(i)];
    EXPECT_LT((spline.derivative(t, 0) - p).norm(), 1e-12) << t;
  }
}

TEST(BSpline, DerivativesEqualFiniteDifferences) {
  std::mt19937 random(2);
  const BSpline spline = random_spline(random, 12, 0.25);
  const double step = 1e-5;
  for (double t = 0.0113; t < spline.duration() - 0.01; t += 0.037)
    for (int order = 1; order <= 3; ++order) {
      const Vec3 slope = (spline.derivative(t + step, order - 1) - spline.derivative(t - step, order - 1)) / (2 * step);
      const double scale = 1 + spline.derivative(t, order).norm();
      EXPECT_LT((spline.derivative(t, order) - slope).norm(), 1e-4 * scale) << t << " order " << order;
    }
}

TEST(BSpline, CommandsAreTwentyMillisecondsApartAndEndAtRest) {
  std::mt19937 random(3);
  const BSpline spline = random_spline(random, 8, 0.131);
  const auto commands = spline.commands();
  ASSERT_GE((static_cast<double>(commands.size()) - 1) * kControlPeriod, spline.duration() - 1e-9);
  ASSERT_LT((static_cast<double>(commands.size()) - 2) * kControlPeriod, spline.duration());
  for (std::size_t k = 0; k + 1 < commands.size(); ++k)
    EXPECT_LT((commands[k].p_W - spline.derivative(static_cast<double>(k) * kControlPeriod, 0)).norm(), 1e-12);
  EXPECT_LT((commands.back().p_W - spline.derivative(spline.duration(), 0)).norm(), 1e-12);
  EXPECT_EQ(commands.back().v_W, Vec3::Zero());
  EXPECT_EQ(commands.back().a_W, Vec3::Zero());
}

TEST(BSpline, HullsOfDerivativeControlPointsHoldTheDerivatives) {
  std::mt19937 random(4);
  const BSpline spline = random_spline(random, 10, 0.2);
  Vec3 v = Vec3::Zero(), a = Vec3::Zero();
  for (const Vec3& p : spline.velocity_points()) v = v.cwiseMax(p.cwiseAbs());
  for (const Vec3& p : spline.acceleration_points()) a = a.cwiseMax(p.cwiseAbs());
  for (double t = 0; t <= spline.duration(); t += 0.003) {
    EXPECT_TRUE((spline.derivative(t, 1).array().abs() <= v.array() + 1e-9).all());
    EXPECT_TRUE((spline.derivative(t, 2).array().abs() <= a.array() + 1e-9).all());
  }
}

TEST(BSpline, JerkIntegralEqualsQuadrature) {
  std::mt19937 random(5);
  const BSpline spline = random_spline(random, 9, 0.2);
  double sum = 0;
  const double step = 1e-4;
  for (double t = step / 2; t < spline.duration(); t += step) sum += spline.derivative(t, 3).squaredNorm() * step;
  EXPECT_NEAR(spline.jerk2() / sum, 1, 1e-9);
}

TEST(BSplineFit, MeetsBothEndsExactly) {
  std::mt19937 random(6);
  for (std::size_t count : {2u, 3u, 4u, 5u, 20u}) {
    std::vector<Vec3> samples;
    for (std::size_t i = 0; i < count; ++i) samples.push_back(random_vector(random, 3));
    const Vec3 v0 = random_vector(random, 1), a0 = random_vector(random, 1), v1 = random_vector(random, 1),
               a1 = random_vector(random, 1);
    const BSpline spline = fit(samples, 0.3, v0, a0, v1, a1);
    const double T = spline.duration();
    EXPECT_NEAR(T, 0.3 * (static_cast<double>(count) - 1), 1e-12);
    EXPECT_LT((spline.derivative(0, 0) - samples.front()).norm(), 1e-12);
    EXPECT_LT((spline.derivative(0, 1) - v0).norm(), 1e-10);
    EXPECT_LT((spline.derivative(0, 2) - a0).norm(), 1e-9);
    EXPECT_LT((spline.derivative(T, 0) - samples.back()).norm(), 1e-12);
    EXPECT_LT((spline.derivative(T, 1) - v1).norm(), 1e-10);
    EXPECT_LT((spline.derivative(T, 2) - a1).norm(), 1e-9);
  }
}

TEST(BSplineFit, ReproducesACubic) {
  const auto p = [](double t) { return Vec3(1 + t - 0.2 * t * t * t, 2 * t * t, -t + 0.1 * t * t * t); };
  const auto v = [](double t) { return Vec3(1 - 0.6 * t * t, 4 * t, -1 + 0.3 * t * t); };
  const auto a = [](double t) { return Vec3(-1.2 * t, 4, 0.6 * t); };
  std::vector<Vec3> samples;
  for (int i = 0; i <= 10; ++i) samples.push_back(p(0.2 * i));
  const BSpline spline = fit(samples, 0.2, v(0), a(0), v(2), a(2));
  for (double t = 0; t <= 2; t += 0.013) EXPECT_LT((spline.derivative(t, 0) - p(t)).norm(), 1e-10) << t;
}

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

TEST(CentreResponse, BasisEqualsThePredictionOfAMovedControlPoint) {
  // The prediction is linear: moving one control point by 1 m moves it by the basis, whatever the delays.
  std::mt19937 random(1);
  for (const Vehicle& vehicle : {test_vehicle(0, 0), test_vehicle(0.02, 0.05), test_vehicle(0.033, 0.08),
                                 test_vehicle(0.1, 0), test_vehicle(0.02, 0.05, 0.015)}) {
    BSpline spline{{}, 0.27};
    for (int i = 0; i < 12; ++i) spline.control_points.push_back(random_vector(random, 1));
    const std::size_t stride = 3, samples = 60;
    const auto basis =
        CentreResponse(vehicle, reach::Loop::vehicle).basis(spline.control_points.size(), 0.27, samples, stride);
    const auto predicted = [&](const BSpline& s) {
      reach::CentrePredictor centre(vehicle, reach::Loop::vehicle, {Vec3(1, 2, 3), Vec3(0.1, 0, 0)}, {0, 0.5, 0}, {});
      std::vector<State> states;
      for (std::size_t k = 0; k < samples * stride; ++k)
        states.push_back(centre.step(s.at(static_cast<double>(k) * 0.02)));
      return states;
    };
    const auto before = predicted(spline);
    for (Eigen::Index point = 0; point < 6; ++point) {
      BSpline moved = spline;
      moved.control_points[static_cast<std::size_t>(point) + 3] += Vec3(1, 1, 1);
      const auto after = predicted(moved);
      for (std::size_t m = 0; m < samples; ++m) {
        const auto row = static_cast<Eigen::Index>(m);
        const std::size_t k = (m + 1) * stride - 1;
        const Vec3 dp = after[k].p_W - before[k].p_W, dv = after[k].v_W - before[k].v_W;
        EXPECT_NEAR(dp.x(), basis.P_horizontal(row, point), 1e-5) << vehicle.controller.latency << " " << m;
        EXPECT_NEAR(dp.z(), basis.P_vertical(row, point), 1e-5);
        EXPECT_NEAR(dv.y(), basis.V_horizontal(row, point), 1e-5);
        EXPECT_NEAR(dv.z(), basis.V_vertical(row, point), 1e-5);
      }
    }
  }
}

/// Room with a block beside a wavy spline that comes too near to it and breaks both limits somewhere.
const World& block_world(bool ball) {
  const auto build = [](std::optional<double> margin) {
    OccupancyGrid grid({0, 0, 0}, 0.1, {60, 30, 20}, Cell::free);
    for (int i = 25; i < 32; ++i)
      for (int j = 0; j < 13; ++j)
        for (int k = 0; k < 20; ++k) grid.set({i, j, k}, Cell::occupied);
    Model model;
    model.ground.l_max = model.ground.l_footprint_max = model.corner.l_max = model.wall.l_max = 0.8;
    model.wall.k1 = {1.0, 0.4, 0.4};
    return build_world(grid, model, test_vehicle(0.02, 0.05), reach::Method::tight, margin);
  };
  static const auto sets = build(std::nullopt), constant = build(0.15);
  return ball ? *constant : *sets;
}

struct Scene {
  const World& world;
  PlanStart start{{Vec3(1.02, 1.51, 1.03), Vec3(0.1, 0, 0)}, {Vec3(1, 1.5, 1), Vec3(0.2, 0, 0), Vec3::Zero(), 0}};

  explicit Scene(bool ball = false) : world(block_world(ball)) {}
  BSpline spline(unsigned seed, double y = 1.68) const {
    std::mt19937 random(seed);
    std::vector<Vec3> samples;
    for (int i = 0; i <= 14; ++i) samples.push_back(Vec3(1 + 4.0 * i / 14, y, 1) + random_vector(random, 0.05));
    samples.front() = start.command.p_W;
    return fit(samples, 0.25, start.command.v_W, start.command.a_W, Vec3::Zero(), Vec3::Zero());
  }
  reach::ReachTube tube(const BSpline& s) const {
    auto commands = s.commands();
    commands.insert(commands.end(), 50, Setpoint(commands.back()));
    return reach::tube_over_field(world.reach, start.estimated, start.command, commands, world.bounds);
  }
  SplineCost cost(const BSpline& s, double margin, const CostWeights& weights) const {
    return {world, s, tube(s), margin, {Vec3::Constant(0.9), Vec3::Constant(1.2)}, weights};
  }
};

using Points = SplineCost::Points;

/// Against central differences at a point away from where the cost was set up, so that no term is at its start.
void expect_exact_gradient(const SplineCost& cost, unsigned seed) {
  std::mt19937 random(seed);
  Points x = cost.start_point();
  for (Eigen::Index i = 0; i < x.rows(); ++i) x.row(i) += random_vector(random, 0.02).transpose();
  const auto value = cost(x);
  const double largest = value.gradient.cwiseAbs().maxCoeff();
  ASSERT_GT(value.f, 0);
  ASSERT_GT(largest, 0);
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const double x0 = x(i), step = 1e-6;
    x(i) = x0 + step;
    const double up = cost(x).f;
    x(i) = x0 - step;
    const double down = cost(x).f;
    x(i) = x0;
    EXPECT_NEAR(value.gradient(i), (up - down) / (2 * step), 2e-5 * largest) << i;
  }
}

TEST(SplineCost, GradientOfTheSmoothnessEqualsFiniteDifferences) {
  const Scene scene;
  expect_exact_gradient(scene.cost(scene.spline(1), 0.02, {1, 0, 0}), 11);
}
TEST(SplineCost, GradientOfTheCollisionCostEqualsFiniteDifferences) {
  for (const bool ball : {false, true}) {
    const Scene scene(ball);
    for (const unsigned seed : {2u, 3u, 4u})
      expect_exact_gradient(scene.cost(scene.spline(seed), 0.2, {0, 1, 0}), seed);
  }
}
TEST(SplineCost, GradientOfTheLimitsEqualsFiniteDifferences) {
  const Scene scene;
  expect_exact_gradient(scene.cost(scene.spline(5), 0.02, {0, 0, 1}), 12);
}

TEST(SplineCost, SmoothnessAndLimitsAreTheModelsSums) {
  // Literal sums over the control points, written out again.
  const Scene scene;
  const BSpline spline = scene.spline(6);
  const auto value = [&](const CostWeights& w) {
    const auto cost = scene.cost(spline, 0.02, w);
    return cost(cost.start_point()).f;
  };
  const auto& q = spline.control_points;
  double smooth = 0, physical = 0;
  for (std::size_t i = 0; i + 3 < q.size(); ++i)
    smooth += (-q[i] + 3 * q[i + 1] - 3 * q[i + 2] + q[i + 3]).squaredNorm();
  const auto beyond = [&](const Vec3& x, double limit) {
    for (int axis = 0; axis < 3; ++axis)
      if (std::abs(x[axis]) > limit) physical += std::pow(x[axis] * x[axis] - limit * limit, 2);
  };
  for (std::size_t i = 0; i + 1 < q.size(); ++i) beyond((q[i + 1] - q[i]) / 0.25, 0.9);
  for (std::size_t i = 0; i + 2 < q.size(); ++i) beyond((q[i + 2] - 2 * q[i + 1] + q[i]) / 0.0625, 1.2);
  ASSERT_GT(physical, 0);
  EXPECT_NEAR(value({1, 0, 0}), smooth, 1e-9 * smooth);
  EXPECT_NEAR(value({0, 0, 1}), physical, 1e-9 * physical);
  EXPECT_NEAR(value({2, 3, 4}), 2 * smooth + 3 * value({0, 1, 0}) + 4 * physical, 1e-6);
}

TEST(SplineCost, PredictsTheClearanceOfTheMovedTube) {
  // Moved away from the wall, the tube is propagated anew: the collision cost must vanish where the new tube keeps the
  // margin and must not where it lacks two centimetres of it.
  const Scene scene;
  const BSpline spline = scene.spline(7);
  for (const double shift : {0.05, 0.1, 0.15, 0.2}) {
    BSpline moved = spline;
    for (std::size_t i = 3; i + 3 < moved.control_points.size(); ++i) moved.control_points[i].y() += shift;
    const double clearance = tube_clearance(scene.world, scene.tube(moved));
    const auto collision = [&](double margin) {
      const auto cost = scene.cost(spline, margin, {0, 1, 0});
      Points x = cost.start_point();
      x.col(1).array() += shift;
      return cost(x).f;
    };
    EXPECT_EQ(collision(clearance - 0.04), 0) << shift;
    EXPECT_GT(collision(clearance + 0.04), 0) << shift;
  }
}

TEST(Optimise, MovesTheTubeOffTheObstacleAndKeepsTheEnds) {
  const Scene scene;
  const BSpline spline = scene.spline(7, 1.58);
  ASSERT_LT(tube_clearance(scene.world, scene.tube(spline)), 0);
  const auto cost = scene.cost(spline, 0.05, {1, 2000, 0});
  const auto before = cost(cost.start_point());
  const auto result = optimise(cost, 200, Clock::now() + std::chrono::seconds(5));
  EXPECT_LT(result.cost, 0.1 * before.f);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(result.spline.control_points[i], spline.control_points[i]);
    EXPECT_EQ(*(result.spline.control_points.end() - 1 - static_cast<std::ptrdiff_t>(i)),
              *(spline.control_points.end() - 1 - static_cast<std::ptrdiff_t>(i)));
  }
  EXPECT_GT(tube_clearance(scene.world, scene.tube(result.spline)), 0);
}

TEST(Optimise, ReturnsTheStartWhenTheDeadlineHasPassed) {
  const Scene scene;
  const BSpline spline = scene.spline(8);
  const auto result = optimise(scene.cost(spline, 0.05, {}), 200, Clock::now());
  for (std::size_t i = 0; i < spline.control_points.size(); ++i)
    EXPECT_EQ(result.spline.control_points[i], spline.control_points[i]);
}

}  // namespace
}  // namespace backwash::plan
