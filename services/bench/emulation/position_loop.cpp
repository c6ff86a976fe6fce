// SPDX-License-Identifier: BSD-3-Clause
#include "services/bench/emulation/position_loop.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::bench {
namespace {

/// Rate that brings an error to zero: proportional near it, then √(2·limit·error), never beyond it within dt.
double square_root(double error, double gain, double limit, double dt) {
  const double linear = limit / (gain * gain), size = std::abs(error);
  const double rate = size > linear ? std::sqrt(2 * limit * (size - linear / 2)) : gain * size;
  return std::copysign(std::min(rate, size / dt), error);
}

AxisTarget advanced(const AxisTarget& now, double a, double dt) {
  return {now.p + now.v * dt + 0.5 * a * dt * dt, now.v + a * dt, a};
}

}  // namespace

AxisTarget shaped_velocity(const AxisTarget& now, double v, const AxisLimits& limits, double dt) noexcept {
  const double wanted =
      std::clamp(square_root(v - now.v, limits.gain, limits.jerk, dt), -limits.acceleration, limits.acceleration);
  return advanced(now, std::clamp(wanted, now.a - limits.jerk * dt, now.a + limits.jerk * dt), dt);
}

AxisTarget shaped(const AxisTarget& now, const AxisTarget& goal, const AxisLimits& limits, double dt) noexcept {
  const double gain = 0.5 * limits.jerk / limits.acceleration;
  const double v = goal.v + square_root(goal.p - now.p, gain, 0.5 * limits.acceleration, dt);
  const double error = std::clamp(v, -limits.speed_down, limits.speed_up) - now.v;
  const double wanted =
      goal.a + std::clamp(square_root(error, limits.gain, limits.jerk, dt), -limits.acceleration, limits.acceleration);
  return advanced(now, std::clamp(wanted, now.a - limits.jerk * dt, now.a + limits.jerk * dt), dt);
}

double CascadeLoop::step(const LoopGains& gains, const AxisTarget& target, double p, double v, double v_dot,
                         double speed_down, double speed_up, double dt) noexcept {
  const double error = std::clamp(target.v + gains.position * (target.p - p), -speed_down, speed_up) - v;
  integral_ = std::clamp(integral_ + gains.integral * error * dt, -kMostIntegral, kMostIntegral);
  return target.a + gains.velocity * error + integral_ +
         gains.derivative * ((gains.derivative_of_error ? target.a : 0) - v_dot);
}

}  // namespace backwash::bench
