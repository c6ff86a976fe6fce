// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/response/error_dynamics.hpp"

#include <algorithm>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "core/loop/position_loop.hpp"
#include "core/reach/response/response_builder.hpp"

namespace backwash::reach {

AxisLoop axis_loop(const Vehicle& vehicle, bool vertical, Loop loop) {
  const loop::PositionLoop of(vehicle);
  const int k = vertical ? 2 : 0;
  AxisLoop axis{of.kp[k], of.kd[k], of.feedback_delay, of.attitude_lag, of.ki[k]};
  if (loop == Loop::continuous) axis.feedback_delay = axis.attitude_lag = 0;
  return axis;
}

Vec3 commanded_acceleration(const Vehicle& vehicle, const State& state, const Setpoint& command) noexcept {
  return loop::PositionLoop(vehicle).asked(command, state);
}

void refuse(const AxisLoop& axis, const char* why) {
  std::ostringstream text;
  text << "error dynamics with k_p = " << axis.kp << " 1/s², k_d = " << axis.kd
       << " 1/s, feedback delay = " << axis.feedback_delay << " s, attitude lag = " << axis.attitude_lag
       << " s: " << why;
  throw std::invalid_argument(text.str());
}

namespace {

// The geometric bound c_j ≤ A ρ^{j−1} of least sum on the excess of the shares over their chords. What may be rounding,
// 1e-9 of the hover set over all ages, counts as none: of an old age it would be raised by ρ^{1−j}.
void bound_chord_excess(AxisResponse& response) {
  const double rounding = 1e-9 * response.h_inf / static_cast<double>(response.S.size());
  std::vector<double> excess;  // age 1, 2, …
  for (std::size_t j = 1; j < response.S.size(); ++j) {
    double largest = 0;
    for (std::size_t m = 1; m < AxisResponse::kPhases; ++m) {
      const double phi = static_cast<double>(m) / AxisResponse::kPhases;
      const double chord = (1 - phi) * response.G[j - 1] + phi * response.G[j];
      largest = std::max(largest, (response.S[j][m - 1] - chord) / (4 * phi * (1 - phi)));
    }
    excess.push_back(largest > rounding ? largest : 0);
  }
  double least = std::numeric_limits<double>::infinity();
  const auto try_decay = [&](double rho) {
    double A = 0, power = 1;
    for (const double c : excess) {
      A = std::max(A, c / power);
      power *= rho;
    }
    if (A / (1 - rho) < least) {
      least = A / (1 - rho);
      response.chord_excess = A;
      response.chord_decay = rho;
    }
  };
  for (double rho = 0.5; rho < 0.9995; rho += 0.0005) try_decay(rho);
  // A loop that hardly damps remembers for minutes.
  const double slowest = 0.1 / static_cast<double>(response.S.size());
  for (double gap = 0.0005; gap > slowest; gap *= 0.95) try_decay(1 - gap);
}

}  // namespace

AxisResponse axis_response(const AxisLoop& axis, Loop loop) {
  if (!(axis.kp > 0) || !(axis.kd > 0)) refuse(axis, "the gains must be positive, the loop is unstable");
  if (!(axis.feedback_delay >= 0) || !(axis.attitude_lag >= 0)) refuse(axis, "delay and lag must not be negative");
  AxisLoop counted = axis;
  if (counted.feedback_delay > 0 && counted.feedback_delay < kMinFeedbackDelay)
    counted.feedback_delay = kMinFeedbackDelay;
  AxisResponse response = loop == Loop::sampled ? sampled_response(counted) : continuous_response(counted);

  const std::size_t steps = response.S.size();
  response.P.assign(steps * AxisResponse::kPhases + 1, 0.0);
  for (std::size_t j = 0; j < steps; ++j) {
    response.G.push_back(response.S[j].back());
    for (std::size_t phase = 1; phase <= AxisResponse::kPhases; ++phase) {
      const std::size_t m = j * AxisResponse::kPhases + phase;
      response.P[m] = response.S[j][phase - 1] + (j > 0 ? response.P[m - AxisResponse::kPhases] : 0.0);
    }
  }
  bound_chord_excess(response);
  if (loop != Loop::sampled && axis.feedback_delay == 0 && axis.attitude_lag == 0)
    response.delay = delay_recursion(axis.kp, axis.kd);
  return response;
}

}  // namespace backwash::reach
