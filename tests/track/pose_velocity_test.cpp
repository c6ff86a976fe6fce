// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/pose_velocity.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace backwash::track {
namespace {

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
