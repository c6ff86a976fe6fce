// SPDX-License-Identifier: BSD-3-Clause
// A pose that leaves what its own twist claims (docs/model.md 4-18).
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "core/track/pose_drift.hpp"
#include "core/track/pose_velocity.hpp"

namespace backwash::track {
namespace {

constexpr double kDt = 0.02;

/// Seconds until what `at` makes of each step is not explained any more; `most` if it always is.
double found_after(PoseDrift& drift, double most, const std::function<PoseDrift::Step(double t)>& at) {
  for (double t = 0; t < most; t += kDt)
    if (!drift.explains(at(t))) return t + kDt;
  return most;
}

/// At rest, the pose drifting at `rate` along a diagonal, since the estimator began.
PoseDrift::Step drifting(double rate, double velocity_error) {
  return {kDt, kDt * rate * Vec3(1, 2, 2) / 3, Vec3::Zero(), Vec3::Zero(), velocity_error};
}

// r T (1 − e^(−t/T)) beyond √((ends E)² + deviations² · 0.25 s · σ_v² T (1 − e^(−2t/T))), on the first scale.
TEST(PoseDrift, IsFoundWhenTheClosedFormSays) {
  const DriftLaw law;
  for (const double E : {0.02, 0.05})
    for (const double error : {0.005, PoseDrift::velocity_error(E), 0.05})
      for (const double rate : {0.01, 0.02, 0.05, 0.1, 0.5}) {
        double expected = 300;
        for (const double T : law.over)
          for (double t = kDt; t < expected; t += kDt) {
            const double variance = 0.25 * error * error * T * (1 - std::exp(-2 * t / T));
            if (rate * T * (1 - std::exp(-t / T)) >
                std::sqrt(law.ends * law.ends * E * E + law.deviations * law.deviations * variance))
              expected = t;
          }
        PoseDrift drift(E, law);
        const double found = found_after(drift, 300, [&](double) { return drifting(rate, error); });
        EXPECT_NEAR(found, expected, 0.01 * expected + 2 * kDt) << E << ", " << error << ", " << rate;
        const double slowest = PoseDrift::slowest(E, error);
        EXPECT_TRUE(found == 300 || rate > 0.98 * slowest) << E << ", " << error << ", " << rate;
        EXPECT_TRUE(found < 300 || rate < 1.02 * slowest) << E << ", " << error << ", " << rate;
      }
}

/// To and fro along x at up to 1.5 m/s, the twist `scale` times what the pose does, and `lag` seconds late.
PoseDrift::Step flown(double t, double scale, double lag) {
  const auto x = [](double s) { return 3 * (1 - std::cos(0.5 * s)); };
  const auto v = [](double s) { return 1.5 * std::sin(0.5 * s); };
  const double from = t, to = t + kDt;
  return {kDt, Vec3(x(to) - x(from), 0, 0), scale * kDt / 2 * Vec3(v(from - lag) + v(to - lag), 0, 0),
          scale * Vec3(v(to - lag) - v(from - lag), 0, 0), 0.001};
}

TEST(PoseDrift, AScaleAndALagOfTheTwistAreExplainedAsFarAsTheLawSays) {
  const auto found = [](double scale, double lag) {
    PoseDrift drift(0.01, {});
    return found_after(drift, 60, [&](double t) { return flown(t, scale, lag); });
  };
  for (const double lag : {-0.028, 0.0, 0.028})
    for (const double scale : {0.985, 1.0, 1.015}) EXPECT_EQ(found(scale, lag), 60) << scale << ", " << lag;
  EXPECT_LT(found(1.06, 0), 10);
  EXPECT_LT(found(1, 0.09), 10);
}

// Straight on at 1.5 m/s, with a twist as it is.
TEST(PoseDrift, AcrossTheWayIsFoundAsAtRestAndAlongItBeyondAScale) {
  const auto found = [](const Vec3& rate) {
    PoseDrift drift(0.02, {});
    return found_after(drift, 60, [&](double) -> PoseDrift::Step {
      return {kDt, kDt * (Vec3(1.5, 0, 0) + rate), kDt * Vec3(1.5, 0, 0), Vec3::Zero(), 0.005};
    });
  };
  PoseDrift at_rest(0.02, {});
  const double resting = found_after(at_rest, 60, [](double) { return drifting(0.02, 0.005); });
  EXPECT_LT(resting, 15);
  EXPECT_NEAR(found({0, 0.02, 0}), resting, 0.1);
  EXPECT_NEAR(found({0, 0, -0.02}), resting, 0.1);
  EXPECT_EQ(found({0.02, 0, 0}), 60);
  EXPECT_LT(found({0.05, 0, 0}), 6);
}

// Three axes of a twist that wanders as it says, over a second: left as often as the level crossings of the exact
// process are bounded by, and no ten times less often. The law's own limit by the same formula: once in 1000 h.
TEST(PoseDrift, IsLeftByChanceAsSeldomAsTheLimitIsDerivedFrom) {
  const auto rate = [](double k, double T) {
    return std::sqrt(2 / std::numbers::pi) * k * k * k * std::exp(-k * k / 2) / T;
  };
  constexpr double k = 3.3, error = 0.02, hours = 4;
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0, error * std::sqrt(PoseDrift::kSettle * kDt));
  PoseDrift drift(0.02, {0, k, 0, 0, {1, 1, 1}});
  int left = 0;
  double settles = 0;
  for (double t = 0; t < hours * 3600; t += kDt) {
    const Vec3 wander(normal(random), normal(random), normal(random));
    if (!drift.explains({kDt, wander, Vec3::Zero(), Vec3::Zero(), error}) && t > settles) {
      ++left;
      settles = t + 3;
    }
  }
  const double expected = hours * 3600 * rate(k, 1);
  EXPECT_LT(left, expected);
  EXPECT_GT(left, expected / 10);
  double all = 0;
  for (const double T : DriftLaw{}.over) all += rate(DriftLaw::kDeviations, T);
  EXPECT_NEAR(1 / (3600 * all), 1000, 100);
}

TEST(PoseDrift, TurnsWithTheMap) {
  const auto found = [](double yaw) {
    PoseDrift drift(0.02, {});
    const RigidShift D{yaw, Vec3(1, 2, 3)};
    bool moved = false;
    return found_after(drift, 60, [&](double t) {
      PoseDrift::Step step = drifting(0.05, 0.005);
      if (t >= 1 && !moved) {
        drift.rebase(D);
        moved = true;
      }
      if (moved) step.moved = D.rotate(step.moved);
      return step;
    });
  };
  EXPECT_NEAR(found(2.5), found(0), 1e-9);
  EXPECT_GT(found(0), 1.1);
}

// What logs were decided by that name no law, written out again.
TEST(PoseDrift, OfOlderLogsIsTheContradictionOverASecond) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  const auto some = [&](double of) -> Vec3 { return of * Vec3(normal(random), normal(random), normal(random)); };
  PoseDrift drift(0.02, kDriftOverASecond);
  Vec3 before = Vec3::Zero();
  int left = 0;
  for (int n = 0; n < 20000; ++n) {
    const PoseDrift::Step step{0.02, some(0.02), some(0.01), some(1), 0.7};
    const Vec3 now = std::exp(-step.dt) * before + step.moved - step.claimed;
    const bool within = now.norm() <= 0.1;
    ASSERT_EQ(drift.explains(step), within) << n;
    if (within) before = now;
    left += !within;
  }
  EXPECT_GT(left, 1000);
  EXPECT_LT(left, 19000);
}

TEST(PoseDrift, WhatIsNoNumberIsNotExplained) {
  PoseDrift drift(0.02, {});
  EXPECT_FALSE(drift.explains({kDt, Vec3(NAN, 0, 0), Vec3::Zero(), Vec3::Zero(), 0.01}));
  EXPECT_FALSE(drift.explains({kDt, Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), NAN}));
  EXPECT_TRUE(drift.explains(drifting(0.01, 0.01)));
}

std::int64_t ns(double s) { return std::llround(s * 1e9); }

/// Largest error along an axis while `position` is told at `rate` with noise that its neighbours do not share.
template <typename Position, typename Velocity>
double largest_error(double rate, double noise, Position position, Velocity velocity) {
  PoseVelocity filter;
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0, noise);
  double largest = 0;
  for (int n = 0; n < static_cast<int>(30 * rate); ++n) {
    const double t = n / rate;
    const auto v = filter.add(ns(t), position(t) + Vec3(normal(random), normal(random), normal(random)));
    if (v) largest = std::max(largest, (*v - velocity(t)).cwiseAbs().maxCoeff());
  }
  return largest;
}

TEST(PoseVelocity, HasNoLagAtConstantAcceleration) {
  for (const double rate : {9.0, 10.0, 20.0, 30.0, 100.0, 500.0})
    EXPECT_LT(largest_error(
                  rate, 0, [](double t) { return Vec3(1 + 2 * t - 0.5 * t * t, t * t, -3 * t); },
                  [](double t) { return Vec3(2 - t, 2 * t, -3); }),
              1e-6)
        << rate;
}

// To and fro with the largest jerk that is reckoned with: a = kJerk/ω at v = kJerk/ω², of 3 m/s² and 0.9 m/s.
TEST(PoseVelocity, ErrsByNoMoreThanItSaysWithNoiseAndJerk) {
  constexpr double w = PoseVelocity::kJerk / 3, amplitude = PoseVelocity::kJerk / (w * w * w);
  for (const double rate : {9.0, 10.0, 20.0, 30.0, 100.0, 200.0}) {
    const double error = largest_error(
        rate, PoseVelocity::kNoise, [](double t) { return Vec3(amplitude * std::sin(w * t), 0, 1); },
        [](double t) { return Vec3(amplitude * w * std::cos(w * t), 0, 0); });
    // 1,200 to 12,000 draws of three axes: the largest is 4.3 standard deviations, the bound holds three.
    EXPECT_LT(error, 1.2 * PoseVelocity::error(rate)) << rate;
    EXPECT_GT(error, 0.4 * PoseVelocity::error(rate)) << rate << ": the bound says nothing";
  }
}

TEST(PoseVelocity, SaysNothingUntilItsWindowIsFilledAndAfterAGap) {
  PoseVelocity filter;
  int first = -1;
  for (int n = 0; n < 30 && first < 0; ++n)
    if (filter.add(ns(n * 0.01), Vec3(n * 0.01, 0, 0))) first = n;
  EXPECT_EQ(first, 20) << "two thirds of 0.3 s";
  EXPECT_FALSE(filter.add(ns(0.19), Vec3(5, 5, 5))) << "a stamp that does not rise";
  const auto on = filter.add(ns(0.21), Vec3(0.21, 0, 0));
  ASSERT_TRUE(on);
  EXPECT_NEAR(on->x(), 1, 1e-6) << "what was out of order changed nothing";
  EXPECT_FALSE(filter.add(ns(0.47), Vec3(0.47, 0, 0))) << "after a gap";
  EXPECT_FALSE(filter.add(ns(-100), Vec3::Zero())) << "and after the sender's clock was set";
}

}  // namespace
}  // namespace backwash::track
