// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/response/delay_recursion.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "core/reach/support.hpp"
#include "tests/reach/axis_rollouts.hpp"

namespace backwash::reach {
namespace {

// The impulse response of the second-order loop, from its characteristic roots.
double impulse_response(double kp, double kd, double t) {
  const double sigma = kd / 2, under_root = kp - sigma * sigma;
  if (under_root > 0) return std::exp(-sigma * t) * std::sin(std::sqrt(under_root) * t) / std::sqrt(under_root);
  if (under_root == 0) return t * std::exp(-sigma * t);
  const double s = std::sqrt(-under_root);
  return (std::exp((s - sigma) * t) - std::exp(-(s + sigma) * t)) / (2 * s);
}

// ∫ |g| over each step, Simpson's rule on 2000 pieces.
std::vector<double> step_shares(double kp, double kd, std::size_t steps) {
  constexpr int kPieces = 2000;
  std::vector<double> G(steps);
  for (std::size_t j = 0; j < steps; ++j)
    for (int i = 0; i < kPieces; ++i) {
      const double h = kControlPeriod / kPieces, t = static_cast<double>(j) * kControlPeriod + h * i;
      const auto g = [&](double at) { return std::abs(impulse_response(kp, kd, at)); };
      G[j] += h / 6 * (g(t) + 4 * g(t + h / 2) + g(t + h));
    }
  return G;
}

std::vector<double> random_bounds(std::size_t count, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<double> w(count);
  for (double& x : w) x = uniform(random) < 0.3 ? 0 : 3 * uniform(random);
  return w;
}

AxisResponse fir_only(AxisResponse response) {
  response.delay.reset();
  return response;
}

TEST(DelayRecursion, IsTheConvolutionWithTheAbsoluteImpulseResponse) {
  constexpr std::size_t kSteps = 700;
  for (const auto& [kp, kd] : kGainSets) {
    SCOPED_TRACE(testing::Message() << kp << " " << kd);
    const AxisResponse response = axis_response({kp, kd, 0, 0}, Loop::continuous);
    ASSERT_TRUE(response.delay);
    EXPECT_EQ(response.delay->echoes.empty(), kd * kd >= 4 * kp);
    EXPECT_LE(response.delay->tail, 1e-6 * response.h_inf);
    const std::vector<double> G = step_shares(kp, kd, kSteps), w = random_bounds(kSteps, 5);
    SupportFilter<1> filter(response);
    for (std::size_t k = 1; k < kSteps; ++k) {
      const double sum = filter.push({w[k - 1]})[0];  // at (k + 1) dt, without step k
      double exact = 0;
      for (std::size_t j = 0; j < k; ++j) exact += w[j] * G[k - j];
      ASSERT_NEAR(sum, exact, filter.tail()[0] + 1e-9 * exact + 1e-13) << k;
      ASSERT_GE(sum + filter.tail()[0], exact - 1e-9 * exact) << k;
      if (static_cast<double>(k) * kControlPeriod < 1) {  // before any tail
        ASSERT_NEAR(sum, exact, 1e-9 * exact + 1e-13) << k;
      }
    }
  }
}

// The tail is needed: of pushes during the one half oscillation after the last echo, the truncated sum has the sign
// wrong.
TEST(DelayRecursion, TailCoversTheEchoesLeftOutAndLittleMore) {
  const AxisResponse response = axis_response({20, 4, 0, 0}, Loop::continuous);
  const double T = std::numbers::pi / 4;  // ω = 4
  const auto M = static_cast<double>(response.delay->echoes.size());
  const auto steps = static_cast<std::size_t>((M + 3) * T / kControlPeriod);
  const std::vector<double> G = step_shares(20, 4, steps + 1);
  SupportFilter<1> filter(response);
  double sum = 0, exact = 0;
  for (std::size_t k = 0; k < steps; ++k) {
    const double age = static_cast<double>(steps - k) * kControlPeriod;
    const double w = age >= (M + 1) * T && age + kControlPeriod <= (M + 2) * T ? 1 : 0;
    sum = filter.push({w})[0];
    exact += w * G[steps - k];
  }
  EXPECT_LE(exact - sum, response.delay->tail);
  EXPECT_GE(exact - sum, 0.5 * response.delay->tail);
  EXPECT_EQ(filter.tail()[0], response.delay->tail);
}

TEST(DelayRecursion, LeavesBarelyDampedAndVeryFastLoopsToTheFir) {
  EXPECT_TRUE(delay_recursion(20, 4));        // ζ = 0.45
  EXPECT_FALSE(delay_recursion(20, 1));       // ζ = 0.11
  EXPECT_FALSE(delay_recursion(40000, 200));  // half an oscillation in 18 ms
  EXPECT_TRUE(delay_recursion(16, 8)->echoes.empty());
  EXPECT_FALSE(axis_response({6, 4, 0, 0.05}, Loop::vehicle).delay);
  EXPECT_FALSE(axis_response({6, 4, 0.03, 0}, Loop::vehicle).delay);
  EXPECT_FALSE(axis_response({6, 4, 0, 0}, Loop::sampled).delay);
}

TEST(DelayRecursion, GivesTheSetsOfTheFir) {
  Vehicle vehicle;
  vehicle.initial_error.position = 0.02;
  vehicle.initial_error.velocity = 0.05;
  for (const auto& [kp, kd] : kGainSets) {
    const AxisResponse recursion = axis_response({kp, kd, 0, 0}, Loop::continuous), fir = fir_only(recursion);
    SupportRecursion a(recursion, recursion, vehicle), b(fir, fir, vehicle);
    const std::vector<double> w = random_bounds(2000, 9);
    for (std::size_t k = 0; k + 5 < w.size(); ++k) {
      const DisturbanceBound bound{{w[k], w[k + 1], w[k + 2], w[k + 3], w[k + 4]}};
      a.step(bound);
      b.step(bound);
      for (std::size_t d = 0; d < kDirections; ++d) {
        const double slack = 3 * (recursion.delay->tail + recursion.tail) + 1e-9 * b.half_widths()[d];
        ASSERT_NEAR(a.half_widths()[d], b.half_widths()[d], slack) << kp << " " << kd << " " << k;
        ASSERT_NEAR(a.half_widths_until_next(bound)[d], b.half_widths_until_next(bound)[d], slack);
      }
    }
  }
}

}  // namespace
}  // namespace backwash::reach
