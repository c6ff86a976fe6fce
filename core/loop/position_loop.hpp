// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <complex>
#include <numbers>

#include "core/types/state.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::loop {

/// The position loop of a vehicle file: the one that calibration, study, adaptation, sets and simulation mean
/// (docs/model.md 3-1, 4-1, 4-4). Vectors hold one number per axis of W.
///
///   u = a_cmd(t − latency) + k_p (p_cmd(t − latency) − p(t − delay)) + k_d (v_cmd(t − latency) − v(t − delay))
///   lag·ȧ = u − a,   v̇ = a + w
///
/// How time is cut is the user's: exactly for held commands (core/reach), in steps of 1 ms with u held (core/sim), or
/// between the rows of a log (core/study/windows/loop.hpp).
struct PositionLoop {
  Vec3 kp = Vec3::Zero();     ///< 1/s²
  Vec3 kd = Vec3::Zero();     ///< 1/s
  Vec3 ki = Vec3::Zero();     ///< integral gain of the velocity loop, 1/s² (4-16)
  double latency = 0;         ///< set-point to controller, s
  double feedback_delay = 0;  ///< measurement to action, s
  double attitude_lag = 0;    ///< s; 0: a = u

  PositionLoop() = default;
  explicit PositionLoop(const Vehicle& vehicle) noexcept
      : kp(per_axis(vehicle.controller.kp)),
        kd(per_axis(vehicle.controller.kd)),
        ki(per_axis(vehicle.controller.velocity_integrator)),
        latency(vehicle.controller.latency),
        feedback_delay(vehicle.controller.feedback_delay),
        attitude_lag(vehicle.controller.attitude_lag) {}
  /// u without an integrator, of a set-point and a state that are as old as they act, m/s².
  Vec3 asked(const Setpoint& command, const State& felt) const noexcept {
    return command.a_W + kp.cwiseProduct(command.p_W - felt.p_W) + kd.cwiseProduct(command.v_W - felt.v_W);
  }
  /// a when u has been held for h seconds, exactly, m/s².
  Vec3 after(const Vec3& a, const Vec3& u, double h) const noexcept {
    return attitude_lag > 0 ? Vec3(u + std::exp(-h / attitude_lag) * (a - u)) : u;
  }
  /// |H(f)|², what of a disturbance's power at f (Hz, > 0) is left in the acceleration along an axis (3-2).
  double passes(int axis, double f_hz) const {
    const std::complex<double> s(0, 2 * std::numbers::pi * f_hz);
    const auto opened = (kp[axis] + kd[axis] * s) * std::exp(-s * feedback_delay) / (s * s * (1.0 + attitude_lag * s));
    return std::norm(1.0 / (1.0 + opened));
  }

 private:
  static Vec3 per_axis(const Vehicle::HorizontalVertical& gain) noexcept {
    return {gain.horizontal, gain.horizontal, gain.vertical};
  }
};

}  // namespace backwash::loop
