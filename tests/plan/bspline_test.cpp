// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "core/plan/spline/bspline.hpp"
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

}  // namespace
}  // namespace backwash::plan
