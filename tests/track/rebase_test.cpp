// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/rebase.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "core/track/frame_alignment.hpp"

namespace backwash::track {
namespace {

constexpr double kVMax = 1.5;  // m/s
constexpr double kAMax = 2.0;  // m/s²

double uniform(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution(low, high)(random);
}

RigidShift random_shift(std::mt19937_64& random, double metres, double radians) {
  return {uniform(random, -radians, radians),
          {uniform(random, -metres, metres), uniform(random, -metres, metres), uniform(random, -metres, metres)}};
}

Eigen::Isometry3d matrix(const RigidShift& s) {
  return Eigen::Translation3d(s.t) * Eigen::AngleAxisd(s.yaw, Vec3::UnitZ());
}

// A straight flight with a cosine profile up to `speed`, every 20 ms.
std::vector<Setpoint> flight(double speed, int steps) {
  std::vector<Setpoint> commands;
  double x = 0;
  const double T = steps * kControlPeriod, w = 2 * M_PI / T;
  for (int k = 0; k <= steps; ++k) {
    const double t = k * kControlPeriod;
    x = speed / 2 * (t - std::sin(w * t) / w);
    commands.push_back({{x, 0.3 * x, 1},
                        {speed / 2 * (1 - std::cos(w * t)), 0.15 * speed * (1 - std::cos(w * t)), 0},
                        {speed / 2 * w * std::sin(w * t), 0.15 * speed * w * std::sin(w * t), 0},
                        0.2});
  }
  return commands;
}

TEST(RigidShift, IsTheRigidMotionOfItsMatrix) {
  std::mt19937_64 random(1);
  for (int round = 0; round < 100; ++round) {
    const RigidShift a = random_shift(random, 3, 3), b = random_shift(random, 3, 3);
    const Vec3 p(uniform(random, -5, 5), uniform(random, -5, 5), uniform(random, -5, 5));
    EXPECT_LT((a.point(p) - matrix(a) * p).norm(), 1e-12);
    EXPECT_LT(((a * b).point(p) - matrix(a) * (matrix(b) * p)).norm(), 1e-12);
    EXPECT_LT((a.inverse().point(a.point(p)) - p).norm(), 1e-12);
    EXPECT_LT((a.inverse().point(p) - matrix(a).inverse() * p).norm(), 1e-12);
  }
}

TEST(Rectified, StaysWhereItFliesUntilTheBranchAndEndsWhereItWasPlanned) {
  std::mt19937_64 random(2);
  for (int round = 0; round < 50; ++round) {
    const auto commands = flight(uniform(random, 0.3, 1.4), 100 + round * 4);
    const RigidShift D = random_shift(random, 0.4, 0.1);
    const std::size_t branch = 10 + random() % 120;
    const auto result = rectified(commands, branch, D, kVMax, kAMax);
    ASSERT_GE(result.size(), commands.size());
    for (std::size_t k = 0; k < std::min(branch, commands.size()); ++k)
      ASSERT_LT((result[k].p_W - matrix(D) * commands[k].p_W).norm(), 1e-12);
    EXPECT_LT((result.back().p_W - commands.back().p_W).norm(), 1e-9);
    EXPECT_LT(result.back().v_W.norm(), 1e-9);
    EXPECT_NEAR(result.back().yaw, commands.back().yaw, 1e-9);
  }
}

TEST(Rectified, NoStepIsLongerThanTheSpeedLimitAllows) {
  std::mt19937_64 random(3);
  for (int round = 0; round < 50; ++round) {
    const double speed = round % 5 == 0 ? kVMax : uniform(random, 0.3, 1.4);
    const auto commands = flight(speed, 100 + round * 4);
    const auto result = rectified(commands, random() % 150, random_shift(random, 0.5, 0.1), kVMax, kAMax);
    for (std::size_t k = 1; k < result.size(); ++k) {
      const double own =
          k < commands.size() ? (commands[k].p_W - commands[k - 1].p_W).norm() : 0;  // v_max is per axis in a plan
      ASSERT_LE((result[k].p_W - result[k - 1].p_W).norm(), std::max(kVMax * kControlPeriod, own) + 1e-9);
    }
  }
}

TEST(Rectified, VelocityAndAccelerationAreThoseOfItsPositions) {
  const auto commands = flight(1.0, 200);
  const auto result = rectified(commands, 40, {0.05, {0.2, -0.3, 0.1}}, kVMax, kAMax);
  const double dt = kControlPeriod;
  for (std::size_t k = 41; k + 1 < result.size(); ++k) {
    const Vec3 v = (result[k + 1].p_W - result[k - 1].p_W) / (2 * dt);
    const Vec3 a = (result[k + 1].p_W - 2 * result[k].p_W + result[k - 1].p_W) / (dt * dt);
    EXPECT_LT((v - result[k].v_W).norm(), 1e-3) << k;
    EXPECT_LT((a - result[k].a_W).norm(), 5e-2) << k;
  }
}

TEST(Rectified, AFlightAtRestGoesBackToItsPlaceInTheMap) {
  const std::vector<Setpoint> hover{{{1, 2, 1}, Vec3::Zero(), Vec3::Zero(), 0}};
  const auto result = rectified(hover, 20, {0, {0.3, 0, 0}}, kVMax, kAMax);
  EXPECT_LT((result.front().p_W - Vec3(1.3, 2, 1)).norm(), 1e-12);
  EXPECT_LT((result.back().p_W - hover[0].p_W).norm(), 1e-12);
}

}  // namespace
}  // namespace backwash::track
