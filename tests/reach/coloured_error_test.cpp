// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/response/coloured_error.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>
#include <unsupported/Eigen/KroneckerProduct>

#include "core/reach/reach_tube.hpp"
#include "tests/reach/axis_rollouts.hpp"

namespace backwash::reach {
namespace {

TEST(ErrorCovariance, OfTheSecondOrderLoopSolvesTheStationaryLyapunovEquation) {
  for (const auto& [kp, kd] : kGainSets) {
    for (const double tau : {0.05, 0.15, 0.5}) {
      Mat3 A;
      A << 0, 1, 0, -kp, -kd, 1, 0, 0, -1 / tau;
      const Mat3 I = Mat3::Identity();
      const Eigen::Matrix<double, 9, 9> L = Eigen::kroneckerProduct(I, A) + Eigen::kroneckerProduct(A, I);
      Eigen::Vector<double, 9> b = Eigen::Vector<double, 9>::Zero();
      b[8] = -2 / tau;
      const Eigen::Vector<double, 9> P = L.fullPivLu().solve(b);
      const ColouredStep step(AxisLoop{kp, kd, 0, 0}, tau);
      ErrorCovariance error(step);
      for (int i = 0; i < 400 * 20; ++i) error.advance(2.0);
      EXPECT_NEAR(error.position_deviation(), 2 * std::sqrt(P[0]), 1e-6 * std::sqrt(P[0]));
      EXPECT_NEAR(error.turn_rate(), std::sqrt(P[4] / P[0]), 1e-5 * std::sqrt(P[4] / P[0]));
      EXPECT_NEAR(error.turned(), error.turn_rate() * 0.0025, 1e-4 * error.turn_rate());
    }
  }
}

// Of ë = −k_p e − k_d ė + w with w nearly white: e^{−ζωt}(cos ω_d t + ζω/ω_d sin ω_d t), and q/(2 k_p k_d).
TEST(SteadyError, HasTheVarianceThatTheRecursionEndsInAndTheMemoryOfTheSecondOrderLoop) {
  for (const auto& [kp, kd] : kGainSets)
    for (const double below : {0.2, 0.02}) {
      const ColouredStep step(AxisLoop{kp, kd, 0, 0}, 1e-3, kControlPeriod);
      const SteadyError steady = steady_error(step, below);
      ErrorCovariance error(step);
      for (int i = 0; i < 50 * 60; ++i) error.advance(1);
      EXPECT_NEAR(std::sqrt(steady.variance), error.position_deviation(), 1e-6 * error.position_deviation());
      EXPECT_NEAR(steady.variance, 2e-3 / (2 * kp * kd), 0.05 * steady.variance);
      const double decay = kd / 2, squared = kp - decay * decay;
      const auto correlation = [&](double t) {
        if (squared == 0) return std::exp(-decay * t) * (1 + decay * t);
        if (squared > 0) {
          const double w = std::sqrt(squared);
          return std::exp(-decay * t) * (std::cos(w * t) + decay / w * std::sin(w * t));
        }
        const double w = std::sqrt(-squared);
        return std::exp(-decay * t) * (std::cosh(w * t) + decay / w * std::sinh(w * t));
      };
      double last = 0;
      for (double t = 0; t < 30; t += 1e-3)
        if (std::abs(correlation(t)) >= below) last = t;
      EXPECT_NEAR(steady.memory, last, 0.025 + 0.02 * last) << kp << ", " << kd;
    }
}

// σ² = s² ∫∫ g(u) g(v) e^{−|u − v|/τ} du dv with g by Runge–Kutta and the true delay: what Padé stands in for.
TEST(ErrorCovariance, OfALaggingAndDelayedLoopEqualsTheDoubleIntegralOfItsImpulseResponse) {
  for (const auto& [lag, delay] :
       {std::pair(0.05, 0.0), std::pair(0.0, 0.03), std::pair(0.05, 0.03), std::pair(0.02, 0.06)}) {
    for (const auto& [kp, kd] : {std::pair(6.0, 4.0), std::pair(1.71, 1.8), std::pair(16.0, 8.0)}) {
      const AxisLoop axis{kp, kd, delay, lag};
      constexpr double kH = 2e-3, kTau = 0.15;
      // A unit velocity whose past feedback is zero: subtract the held past by starting from rest and pushing hard.
      AxisRollouts motion(axis, false, kH, Eigen::ArrayXd::Zero(1), Eigen::ArrayXd::Zero(1));
      motion.step(Eigen::ArrayXd::Constant(1, 1 / kH));
      std::vector<double> g{motion.p()[0]};
      for (int i = 0; i < 4000; ++i) {
        motion.step(Eigen::ArrayXd::Zero(1));
        g.push_back(motion.p()[0]);
      }
      // ∫∫ = 2 ∫ g(u) y(u) du with y the past of g, filtered by 1/τ.
      double past = 0, sum = 0;
      for (const double x : g) {
        sum += 2 * x * (past + x / 2) * kH * kH;
        past = std::exp(-kH / kTau) * (past + x);
      }
      const ColouredStep step(axis, kTau);
      ErrorCovariance error(step);
      for (int i = 0; i < 400 * 10; ++i) error.advance(1.0);
      EXPECT_NEAR(error.position_deviation(), std::sqrt(sum), 2e-3 * std::sqrt(sum))
          << kp << " " << lag << " " << delay;
    }
  }
}

// docs/model.md section 5.3: the 3σ worst case is 6 to 8 error standard deviations for τ_w of 0.1 to 0.2 s.
TEST(ErrorCovariance, IsSixToEightTimesBelowTheWorstCase) {
  Vehicle vehicle;
  vehicle.controller.kp = {6, 6};
  vehicle.controller.kd = {4, 4};
  vehicle.controller.attitude_lag = vehicle.controller.feedback_delay = 0;
  const Reachability reach(vehicle, Method::tight, Loop::continuous);
  for (const double tau : {0.1, 0.15, 0.2}) {
    const ColouredStep step(AxisLoop{6, 4, 0, 0}, tau);
    ErrorCovariance error(step);
    for (int i = 0; i < 4000; ++i) error.advance(1);
    const double ratio = 3 * reach.horizontal.h_inf / error.position_deviation();
    EXPECT_GT(ratio, 5.9);
    EXPECT_LT(ratio, 8.2);
  }
}

TEST(ExitLevel, SolvesRicesFormulaAndCountsTheStart) {
  const double eta = exit_level(3, 10, 1e-3);  // nobody is outside of 10 σ
  EXPECT_NEAR(3 / std::numbers::pi * std::exp(-eta * eta / 2) + std::erfc(eta / std::numbers::sqrt2), 1e-3, 1e-9);
  const double same = exit_level(3, 3.0, 1e-2);  // no jump at its root of 2.99
  EXPECT_LT(same, 3.02);
  EXPECT_GT(exit_level(3, 10, 1e-4), eta);
  EXPECT_GT(exit_level(6, 10, 1e-3), eta);
}

}  // namespace
}  // namespace backwash::reach
