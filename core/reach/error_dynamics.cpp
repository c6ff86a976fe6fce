// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/error_dynamics.hpp"

#include <sstream>
#include <stdexcept>

#include "core/reach/response_builder.hpp"

namespace backwash::reach {

AxisLoop axis_loop(const Vehicle& vehicle, bool vertical, Loop loop) {
  const auto& c = vehicle.controller;
  AxisLoop axis{vertical ? c.kp.vertical : c.kp.horizontal, vertical ? c.kd.vertical : c.kd.horizontal,
                c.feedback_delay, c.attitude_lag};
  if (loop == Loop::continuous) axis.feedback_delay = axis.attitude_lag = 0;
  return axis;
}

Vec3 commanded_acceleration(const Vehicle& vehicle, const State& state, const Setpoint& command) noexcept {
  const auto& c = vehicle.controller;
  const Vec3 kp(c.kp.horizontal, c.kp.horizontal, c.kp.vertical), kd(c.kd.horizontal, c.kd.horizontal, c.kd.vertical);
  return command.a_W + kp.cwiseProduct(command.p_W - state.p_W) + kd.cwiseProduct(command.v_W - state.v_W);
}

void refuse(const AxisLoop& axis, const char* why) {
  std::ostringstream text;
  text << "error dynamics with k_p = " << axis.kp << " 1/s², k_d = " << axis.kd
       << " 1/s, feedback delay = " << axis.feedback_delay << " s, attitude lag = " << axis.attitude_lag
       << " s: " << why;
  throw std::invalid_argument(text.str());
}

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
  return response;
}

}  // namespace backwash::reach
