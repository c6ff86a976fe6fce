// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace backwash::bench {

/// Where one axis shall be, m, m/s, m/s².
struct AxisTarget {
  double p = 0, v = 0, a = 0;
};

struct AxisLimits {
  double speed_down = 0, speed_up = 0;  ///< m/s, ≥ 0
  double acceleration = 0, jerk = 0;    ///< m/s², m/s³
  double gain = jerk / acceleration;    ///< 1/s, on velocity
};

/// The next target on the way from `now` to `goal`, `dt` s later, within the limits: ArduPilot's input shaping
/// (AP_Math/control.cpp, shape_pos_vel_accel). Gains: half of jerk/acceleration on position, `gain` on velocity, each
/// continued by a square root where the braking distance counts. A large gain is nearly time-optimal.
AxisTarget shaped(const AxisTarget& now, const AxisTarget& goal, const AxisLimits& limits, double dt) noexcept;
/// The same towards a velocity, wherever that leads.
AxisTarget shaped_velocity(const AxisTarget& now, double v, const AxisLimits& limits, double dt) noexcept;

/// Gains of one axis, 1/s, 1/s, 1/s², 1.
struct LoopGains {
  double position = 0, velocity = 0, integral = 0, derivative = 0;
  bool derivative_of_error = false;  ///< ArduPilot's D acts on a_t − v̇, PX4's on −v̇
};

/// P on position, PI and D on velocity, as both autopilots have it:
///   v_w = v_t + P_p (p_t − p), within the speeds;   u = a_t + P_v (v_w − v) + I ∫(v_w − v) + D (a_t or 0 − v̇)
class CascadeLoop {
 public:
  static constexpr double kMostIntegral = 5;  ///< m/s²
  /// Acceleration to ask for, m/s².
  double step(const LoopGains& gains, const AxisTarget& target, double p, double v, double v_dot, double speed_down,
              double speed_up, double dt) noexcept;
  void reset() noexcept { integral_ = 0; }

 private:
  double integral_ = 0;
};

}  // namespace backwash::bench
