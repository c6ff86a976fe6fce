// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "core/plan/search/motion_primitive.hpp"
#include "tests/plan/drawn.hpp"

namespace backwash::plan {
namespace {

Motion random_motion(std::mt19937& random) {
  return {{random_vector(random, 1), random_vector(random, 1), random_vector(random, 1), random_vector(random, 1)},
          std::uniform_real_distribution<double>(0.2, 2)(random)};
}

/// ∫ ‖u‖² dt by Simpson's rule, exact for the quadratic integrand.
double integrated_effort(const Motion& m) {
  const auto f = [&](double t) { return m.acceleration(t).squaredNorm(); };
  return m.duration / 6 * (f(0) + 4 * f(m.duration / 2) + f(m.duration));
}

TEST(Motion, EffortIsTheIntegralOfSquaredAcceleration) {
  std::mt19937 random(1);
  for (int i = 0; i < 100; ++i) {
    const Motion m = random_motion(random);
    EXPECT_NEAR(m.effort() / integrated_effort(m), 1, 1e-12);
  }
}

TEST(Motion, BoundsHoldEverySampleAndAreAttained) {
  std::mt19937 random(2);
  for (int i = 0; i < 200; ++i) {
    Motion m = random_motion(random);
    if (i % 3 == 0) m.c[3].setZero();
    if (i % 9 == 0) m.c[2].x() = 0;
    const double from = 0.1 * m.duration, to = 0.8 * m.duration;
    const Box box = bounds(m, from, to);
    Vec3 low = m.position(from), high = low;
    for (int k = 0; k <= 4000; ++k) {
      const Vec3 p = m.position(from + (to - from) * k / 4000);
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    EXPECT_TRUE((box.low.array() <= low.array() + 1e-12).all() && (box.high.array() >= high.array() - 1e-12).all());
    EXPECT_LT((box.low - low).norm() + (box.high - high).norm(), 1e-4);
  }
}

TEST(Motion, PeaksHoldEverySampleAndAreAttained) {
  std::mt19937 random(3);
  for (int i = 0; i < 200; ++i) {
    const Motion m = random_motion(random);
    Vec3 v = Vec3::Zero(), a = Vec3::Zero();
    for (int k = 0; k <= 4000; ++k) {
      v = v.cwiseMax(m.velocity(m.duration * k / 4000).cwiseAbs());
      a = a.cwiseMax(m.acceleration(m.duration * k / 4000).cwiseAbs());
    }
    EXPECT_LT((m.peak_velocity() - v).norm(), 1e-4);
    EXPECT_LT((m.peak_acceleration() - a).norm(), 1e-9);
    EXPECT_TRUE((m.peak_velocity().array() >= v.array() - 1e-12).all());
  }
}

TEST(OptimalCubic, EndsAtRestAtTheGoal) {
  std::mt19937 random(4);
  for (int i = 0; i < 100; ++i) {
    const State from{random_vector(random, 5), random_vector(random, 2)};
    const Vec3 goal = random_vector(random, 5);
    const Motion m = optimal_cubic(from, goal, 1.7);
    EXPECT_LT((m.end().p_W - goal).norm() + m.end().v_W.norm(), 1e-10);
    EXPECT_LT((m.position(0) - from.p_W).norm() + (m.velocity(0) - from.v_W).norm(), 1e-12);
  }
}

TEST(OptimalCubic, IsNoCostlierThanAnyOtherMotionWithItsEnds) {
  std::mt19937 random(5);
  for (int i = 0; i < 100; ++i) {
    const State from{random_vector(random, 5), random_vector(random, 2)};
    const Vec3 goal = random_vector(random, 5);
    const double T = 1.3;
    const Motion m = optimal_cubic(from, goal, T);
    // Any bump t²(T − t)² b keeps both ends; its second derivative is b (2T² − 12Tt + 12t²).
    const Vec3 b = random_vector(random, 1);
    double bumped = 0;
    const int n = 2000;
    for (int k = 0; k < n; ++k) {
      const double t = (k + 0.5) * T / n;
      bumped += (m.acceleration(t) + b * (2 * T * T - 12 * T * t + 12 * t * t)).squaredNorm() * T / n;
    }
    EXPECT_GT(bumped, m.effort() * (1 - 1e-6));
  }
}

TEST(DepressedQuartic, FindsTheRootsItWasBuiltFrom) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> u(-5, 5);
  for (int i = 0; i < 2000; ++i) {
    const double a = u(random), b = u(random), c = u(random), d = -a - b - c;  // the cubic term vanishes
    const double p = a * b + a * c + a * d + b * c + b * d + c * d;
    const double q = -(a * b * c + a * b * d + a * c * d + b * c * d), r = a * b * c * d;
    const auto roots = depressed_quartic_roots(p, q, r);
    for (const double root : {a, b, c, d}) {
      double nearest = INFINITY;
      for (const double found : roots) nearest = std::min(nearest, std::abs(found - root));
      EXPECT_LT(nearest, 1e-4) << a << " " << b << " " << c << " " << d;
    }
  }
}

/// min over a dense set of T ≥ least of ρT + effort, effort from the integral of the closing motion.
double dense_minimum(const State& from, const Vec3& goal, double rho, double least) {
  double best = INFINITY;
  for (double T = std::max(least, 1e-3); T < 200; T *= 1.002)
    best = std::min(best, rho * T + integrated_effort(optimal_cubic(from, goal, T)));
  return best;
}

TEST(CostToGo, EqualsADenseMinimisationOverTheDuration) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> log_rho(-3, 2), least(0, 6);
  for (int i = 0; i < 1000; ++i) {
    const State from{random_vector(random, 5), random_vector(random, 2)};
    const Vec3 goal = i % 4 == 0 ? Vec3(from.p_W + 0.7 * from.v_W) : random_vector(random, 5);
    const double rho = std::pow(10, log_rho(random)), T0 = i % 2 == 0 ? 0.02 : least(random);
    const double numeric = dense_minimum(from, goal, rho, T0);
    const auto found = cost_to_go(from, goal, rho, T0);
    EXPECT_LE(found.cost, numeric * (1 + 1e-9)) << i;
    EXPECT_GE(found.cost, numeric * (1 - 1e-3)) << i;
    EXPECT_GE(found.duration, T0);
    EXPECT_NEAR(found.cost, rho * found.duration + integrated_effort(optimal_cubic(from, goal, found.duration)),
                1e-9 * found.cost);
  }
}

TEST(CostToGo, NeverExceedsTheCostOfAMotionThatReachesTheGoal) {
  // Random bang-coast inputs run forward; wherever they end at rest is taken as the goal.
  std::mt19937 random(8);
  std::uniform_real_distribution<double> time(0.1, 1.5);
  for (int i = 0; i < 500; ++i) {
    State s{random_vector(random, 2), random_vector(random, 1)};
    const State from = s;
    double cost = 0, total = 0;
    const double rho = 2;
    for (int piece = 0; piece < 4; ++piece) {
      const double T = time(random);
      const Vec3 u = piece == 3 ? Vec3(-s.v_W / T) : random_vector(random, 1);
      const Motion m = primitive(s, u, T);
      cost += m.effort() + rho * T;
      total += T;
      s = m.end();
    }
    ASSERT_LT(s.v_W.norm(), 1e-12);
    EXPECT_LE(cost_to_go(from, s.p_W, rho, 0.02).cost, cost * (1 + 1e-12));
    EXPECT_LE(cost_to_go(from, s.p_W, rho, total).cost, cost * (1 + 1e-12));
  }
}

TEST(LeastStoppingTime, IsTheTimeInWhichTheFastestProfileCoversTheDistance) {
  // Speed min(s0 + a t, V, a (T − t)) integrated numerically; the least T is bracketed by what it covers.
  const auto covered = [](double T, double s0, double v_max, double a) {
    double sum = 0;
    const int n = 20000;
    for (int k = 0; k < n; ++k) {
      const double t = (k + 0.5) * T / n;
      sum += std::min({s0 + a * t, std::max(v_max, s0), a * (T - t)}) * T / n;
    }
    return sum;
  };
  std::mt19937 random(9);
  std::uniform_real_distribution<double> u(0, 1);
  for (int i = 0; i < 300; ++i) {
    const double s0 = 3 * u(random), v_max = 0.2 + 2 * u(random), a = 0.2 + 3 * u(random), d = 6 * u(random);
    const double T = least_stopping_time(d, s0, v_max, a);
    if (T > s0 / a * (1 + 1e-12))
      EXPECT_NEAR(covered(T, s0, v_max, a), d, 1e-3 * (1 + d));
    else  // stopping alone takes longer than the way
      EXPECT_GE(s0 * s0 / (2 * a), d * (1 - 1e-9));
  }
}

}  // namespace
}  // namespace backwash::plan
