// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/response/error_dynamics.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "tests/reach/axis_rollouts.hpp"

namespace backwash::reach {
namespace {

using Batch = AxisRollouts::Batch;
constexpr int kPhases = AxisResponse::kPhases;

// coth(πζ/(2√(1 − ζ²)))/k_p, or 1/k_p without overshoot (docs/model.md section 5.2).
double closed_form_hover(double kp, double kd) {
  const double zeta = kd / (2 * std::sqrt(kp));
  if (zeta >= 1) return 1 / kp;
  return 1 / (kp * std::tanh(std::numbers::pi * zeta / (2 * std::sqrt(1 - zeta * zeta))));
}

TEST(AxisResponse, HoverHalfWidthIsTheClosedForm) {
  EXPECT_NEAR(closed_form_hover(6, 4), 0.17063, 5e-6);
  for (const auto& [kp, kd] : kGainSets) {
    const AxisResponse r = axis_response({kp, kd, 0, 0}, Loop::continuous);
    EXPECT_NEAR(r.h_inf / closed_form_hover(kp, kd), 1, 1e-6) << kp << " " << kd;
    EXPECT_LE(r.tail, 1e-6 * r.h_inf);
    EXPECT_NEAR(r.P.back() / closed_form_hover(kp, kd), 1, 1e-6);
  }
}

// The rounding of an old share, taken for an excess, would be raised by ρ^−63,000 and make intervals of metres.
TEST(AxisResponse, RoundingIsNoExcessOverTheChordOfASlowLoop) {
  const AxisResponse slow = axis_response({0.11, 10.3, 0.014, 0.01}, Loop::vehicle);
  EXPECT_GT(slow.G.size(), 60000u);
  EXPECT_LT(slow.chord_excess / (1 - slow.chord_decay), 1e-3 * slow.h_inf);
}

// For the underdamped second-order loop, |g| integrates in closed form between its zeros at multiples of π/ω.
TEST(AxisResponse, IntegralOfTheImpulseResponseIsExactWithoutDelay) {
  constexpr double kp = 20, kd = 4, sigma = kd / 2;
  const double omega = std::sqrt(kp - sigma * sigma);
  const auto antiderivative = [&](double t) {
    return -std::exp(-sigma * t) * (sigma * std::sin(omega * t) + omega * std::cos(omega * t)) / (omega * kp);
  };
  const AxisResponse r = axis_response({kp, kd, 0, 0}, Loop::continuous);
  for (std::size_t m = 1; m < r.P.size(); ++m) {
    const double t = static_cast<double>(m) * kControlPeriod / kPhases;
    double exact = 0, from = 0;
    while (from < t) {
      const double zero = (std::floor(from * omega / std::numbers::pi + 1e-9) + 1) * std::numbers::pi / omega;
      exact += std::abs(antiderivative(std::min(t, zero)) - antiderivative(from));
      from = std::min(t, zero);
    }
    ASSERT_NEAR(r.P[m] / exact, 1, 1e-9) << t;
  }
}

TEST(AxisResponse, VehicleLoopWithoutLagAndDelayEqualsContinuous) {
  Vehicle vehicle;
  vehicle.controller.kp = {6, 20};
  vehicle.controller.kd = {4, 4};
  for (const bool vertical : {false, true}) {
    const AxisResponse a = axis_response(axis_loop(vehicle, vertical, Loop::vehicle), Loop::vehicle);
    vehicle.controller.attitude_lag = 0.05;  // Loop::continuous drops both
    vehicle.controller.feedback_delay = 0.03;
    const AxisResponse b = axis_response(axis_loop(vehicle, vertical, Loop::continuous), Loop::continuous);
    vehicle.controller.attitude_lag = vehicle.controller.feedback_delay = 0;
    ASSERT_EQ(a.P.size(), b.P.size());
    for (std::size_t m = 0; m < a.P.size(); ++m) {
      EXPECT_NEAR(a.P[m], b.P[m], 1e-9);
      EXPECT_NEAR(a.from_position[m], b.from_position[m], 1e-9);
      EXPECT_NEAR(a.from_velocity[m], b.from_velocity[m], 1e-9);
    }
  }
}

// Delays on and off the grids of 20 ms, 2.5 ms and 0.25 ms, with and without lag.
constexpr AxisLoop kLoops[] = {{6, 4, 0, 0},          {6, 4, 0, 0.05},    {6, 4, 0.03, 0.05}, {6, 4, 0.0312, 0.05},
                               {20, 4, 0.0312, 0.05}, {16, 8, 0.0312, 0}, {6, 8, 0.0051, 0},  {1.71, 1.8, 0.06, 0.1}};

TEST(AxisResponse, EqualsIndependentIntegration) {
  constexpr double h = 1e-4;
  constexpr int kPerPhase = 25;
  for (const AxisLoop& axis : kLoops) {
    SCOPED_TRACE(testing::Message() << axis.kp << " " << axis.kd << " " << axis.feedback_delay << " "
                                    << axis.attitude_lag);
    const AxisResponse r = axis_response(axis, Loop::vehicle);
    // Unit errors of position and of velocity, seen by the feedback before 0 as well.
    AxisRollouts initial(axis, false, h, Batch{{1, 0}}, Batch{{0, 1}});
    AxisRollouts step(axis, false, h, Batch{{0.0}}, Batch{{0.0}});  // g's integral: the response to w = 1
    double P = 0, last = 0;
    const std::size_t phases = std::min<std::size_t>(r.P.size() - 1, 3 * 50 * kPhases);
    double worst_P = 0, worst_initial = 0;
    for (std::size_t m = 1; m <= phases; ++m) {
      for (int i = 0; i < kPerPhase; ++i) {
        initial.step(Batch{{0, 0}});
        step.step(Batch{{1.0}});
        P += std::abs(step.p()[0] - last);  // |∫ g| over 0.1 ms: ∫ |g| unless g changes sign inside
        last = step.p()[0];
      }
      worst_P = std::max(worst_P, std::abs(P - r.P[m]));
      worst_initial = std::max({worst_initial, std::abs(initial.p()[0] - r.from_position[m]),
                                std::abs(initial.p()[1] - r.from_velocity[m])});
    }
    EXPECT_LT(worst_P, 1e-6 * r.h_inf);
    EXPECT_LT(worst_initial, 1e-6);
  }
}

TEST(AxisResponse, TailCoversWhatComesAfterTheTableAndVelocityIsTheIntegralOfItsResponse) {
  for (const AxisLoop& axis : {AxisLoop{6, 4, 0, 0.05}, AxisLoop{20, 4, 0.0312, 0.05}, AxisLoop{16, 8, 0.0312, 0}}) {
    const AxisResponse r = axis_response(axis, Loop::vehicle);
    constexpr double h = 1e-4;
    const std::size_t steps = r.G.size();
    AxisRollouts step(axis, false, h, Batch{{0.0}}, Batch{{0.0}}),
        initial(axis, false, h, Batch{{1, 0}}, Batch{{0, 1}});
    double after = 0, last = 0, last_v = 0, speed = 0, position = 0, velocity = 0;
    // Shares of a step of age ≥ N start at (N − 1) dt for an instant just after a sample.
    const std::size_t first = (steps - 1) * 200;
    for (std::size_t i = 0; i < 2 * steps * 200; ++i) {
      step.step(Batch{{1.0}});
      initial.step(Batch{{0, 0}});
      if (i >= first) after += std::abs(step.p()[0] - last);
      if (i >= steps * 200) {
        position = std::max(position, std::abs(initial.p()[0]));
        velocity = std::max(velocity, std::abs(initial.p()[1]));
      }
      speed += std::abs(step.v()[0] - last_v);  // |∫ ġ|
      last = step.p()[0];
      last_v = step.v()[0];
    }
    EXPECT_NEAR(speed / r.velocity_inf, 1, 1e-5);
    EXPECT_LE(after, r.tail * (1 + 1e-6) + 1e-11);
    EXPECT_LE(position, r.from_position_tail + 1e-11);
    EXPECT_LE(velocity, r.from_velocity_tail + 1e-11);
    EXPECT_LE(r.tail, 1e-6 * r.h_inf);
  }
}

TEST(AxisResponse, SharesAddUpToTheTables) {
  for (const Loop loop : {Loop::vehicle, Loop::sampled}) {
    const AxisResponse r = axis_response({6, 4, 0.0312, 0.05}, loop);
    double sum = 0;
    for (std::size_t j = 0; j < r.G.size(); ++j) {
      EXPECT_EQ(r.G[j], r.S[j].back());
      sum += r.G[j];
      EXPECT_NEAR(r.P[(j + 1) * kPhases], sum, 1e-14);
    }
    EXPECT_GE(r.h_inf, sum);
    EXPECT_NEAR(r.h_inf / (sum + r.tail), 1, 1e-3);
  }
}

// With the feedback held, an impulse at instant s of a step: the share of that step is the integral over s. The oracle
// pushes for 0.1 ms at each of the 200 instants and integrates numerically.
TEST(AxisResponse, SampledSharesEqualTheIntegralOverTheInstantOfTheImpulse) {
  constexpr double h = 1e-4;
  constexpr int kInstants = 200, kPerPhase = 25;
  for (const AxisLoop& axis : {AxisLoop{6, 4, 0, 0}, AxisLoop{6, 4, 0, 0.05}, AxisLoop{20, 4, 0.03, 0.05},
                               AxisLoop{6, 4, 0.02, 0.05}, AxisLoop{16, 8, 0.0051, 0.05}, AxisLoop{6, 8, 0.047, 0}}) {
    SCOPED_TRACE(testing::Message() << axis.kp << " " << axis.kd << " " << axis.feedback_delay << " "
                                    << axis.attitude_lag);
    const AxisResponse r = axis_response(axis, Loop::sampled);
    AxisRollouts push(axis, true, h, Batch::Zero(kInstants), Batch::Zero(kInstants));
    AxisRollouts initial(axis, true, h, Batch{{1, 0}}, Batch{{0, 1}});
    double worst = 0, worst_initial = 0;
    for (std::size_t m = 1; m <= 60 * kPhases; ++m) {
      for (int i = 0; i < kPerPhase; ++i) {
        const auto instant = static_cast<Eigen::Index>(m - 1) * kPerPhase + i;
        Batch w = Batch::Zero(kInstants);
        if (instant < kInstants) w[instant] = 1;
        push.step(w);
        initial.step(Batch{{0, 0}});
      }
      const double share = push.p().abs().sum();
      worst = std::max(worst, std::abs(share - r.S[(m - 1) / kPhases][(m - 1) % kPhases]));
      worst_initial = std::max({worst_initial, std::abs(initial.p()[0] - r.from_position[m]),
                                std::abs(initial.p()[1] - r.from_velocity[m])});
    }
    EXPECT_LT(worst, 1e-4 * kControlPeriod * kControlPeriod);  // a change of sign inside one push
    EXPECT_LT(worst_initial, 1e-8);
  }
}

TEST(AxisResponse, RefusesUnstableLoopsAndNamesTheGains) {
  const auto refused = [](const AxisLoop& axis, Loop loop) {
    try {
      axis_response(axis, loop);
    } catch (const std::invalid_argument& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  const std::string why = refused({20, 4, 0, 0.21}, Loop::vehicle);  // lag k_p > k_d
  EXPECT_NE(why.find("k_p = 20"), std::string::npos) << why;
  EXPECT_NE(why.find("k_d = 4"), std::string::npos) << why;
  EXPECT_EQ(refused({20, 4, 0, 0.19}, Loop::vehicle), "");
  for (const Loop loop : {Loop::continuous, Loop::vehicle, Loop::sampled})
    for (const auto& [kp, kd] : {std::pair(0, 4), std::pair(-6, 4), std::pair(6, 0), std::pair(6, -1)})
      EXPECT_NE(refused({1.0 * kp, 1.0 * kd, 0, 0}, loop).find("gains must be positive"), std::string::npos);
  EXPECT_NE(refused({6, 4, -0.01, 0}, Loop::vehicle), "");
  EXPECT_NE(refused({6, 110, 0, 0}, Loop::sampled), "");  // k_d dt > 2
  EXPECT_EQ(refused({6, 90, 0, 0}, Loop::continuous), "");

  // s² + (k_d s + k_p) e^{−sδ} has roots on the imaginary axis first at δ_c = atan(k_d ω/k_p)/ω,
  // ω² = (k_d² + √(k_d⁴ + 4 k_p²))/2.
  for (const auto& [kp, kd] : kGainSets) {
    const double omega = std::sqrt((kd * kd + std::sqrt(kd * kd * kd * kd + 4 * kp * kp)) / 2);
    const double critical = std::atan(kd * omega / kp) / omega;
    EXPECT_EQ(refused({kp, kd, 0.93 * critical, 0}, Loop::vehicle), "") << kp << " " << kd;
    EXPECT_NE(refused({kp, kd, 1.02 * critical, 0}, Loop::vehicle), "") << kp << " " << kd;
  }
}

}  // namespace
}  // namespace backwash::reach
