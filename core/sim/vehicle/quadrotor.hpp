// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "core/loop/position_loop.hpp"
#include "core/sim/vehicle/thrust_terms.hpp"
#include "core/types/state.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::sim {

/// Quadrotor with its own position/velocity/acceleration controller, thrust and tilt limits and first-order attitude
/// lag, integrated at 1 kHz. Frames: W z-up; body x forward, y left, z up.
///
///   u = a_cmd + k_p (p_cmd − p̂) + k_d (v_cmd − v̂)   set-points `latency` old, p̂ and v̂ `feedback_delay` old
///     + i,   di/dt = k_i/k_d (k_p (p_cmd − p̂) + k_d (v_cmd − v̂)), k_i the velocity integrator, 0 on the ground
///   f = saturated(u + g e_z)                         specific force the rotors shall produce
///   lag·ȧ = (f − g e_z) − a,   ṗ = v,   v̇ = a + w
///
/// With thrust terms the rotors give something else than f along its direction; what is commanded and logged stays.
class Quadrotor {
 public:
  static constexpr double kStep = 1e-3;                       ///< s
  static constexpr double kMinThrust = 0.05;                  ///< of max_thrust: the rotors never stop in the air
  static constexpr double kMaxTilt = 0.78539816339744830962;  ///< 45°, rad
  static constexpr double kMaxYawRate = 1.0;                  ///< rad/s

  /// Hovering at `start`, motors on, the set-point there. `z_floor`: height of the vehicle's centre when it stands on
  /// the ground, m: it never sinks below, and stands still there while its thrust does not lift it.
  Quadrotor(const Vehicle& vehicle, const State& start, std::optional<double> z_floor = std::nullopt);
  /// Issues a set-point; it reaches the controller `latency` later.
  void command(const Setpoint& setpoint);
  /// Motors off: no thrust at all (standing disarmed, or falling). On again: thrust builds up with the attitude lag.
  void set_motors(bool on) noexcept { motors_on_ = on; }
  /// What the rotors give for what they are told; `voltage`: of the battery from now on, V.
  void set_thrust_terms(ThrustTerms terms) { thrust_terms_ = std::move(terms); }
  void set_voltage(std::optional<double> voltage) noexcept { voltage_ = voltage; }
  /// Turns the body at once: a heading that was measured, for flights that are flown again, rad.
  void set_heading(double yaw) noexcept { yaw_ = active_.yaw = yaw; }
  /// One kStep. `w_W`: disturbance acceleration, m/s². `estimated`: what the controller believes its state is.
  void step(const Vec3& w_W, const State& estimated);

  double time() const noexcept { return static_cast<double>(steps_) * kStep; }
  const State& state() const noexcept { return state_; }
  const Vec3& acceleration() const noexcept {
    return acceleration_;
  }  ///< m/s², W, gravity removed, disturbance included
  bool on_ground() const noexcept { return on_ground_; }
  double yaw() const noexcept { return yaw_; }  ///< rad
  double commanded_thrust() const noexcept;     ///< per mass, m/s²
  Eigen::Quaterniond attitude() const;          ///< body to world: z along the thrust, x towards the yaw
  double thrust() const noexcept;  ///< normalised collective command u, 0..1, by the vehicle's thrust curve

 private:
  Vec3 specific_force(const State& believed) noexcept;
  Vec3 given(const Vec3& produced);

  Vehicle vehicle_;
  loop::PositionLoop loop_;
  State state_;
  std::optional<double> z_floor_;
  bool motors_on_ = true, on_ground_ = false;
  Vec3 acceleration_ = Vec3::Zero();
  Vec3 integrated_ = Vec3::Zero();  // what the velocity's integrator asks for, m/s²
  Vec3 produced_ = Vec3::Zero();    // acceleration the rotors produce, gravity removed
  long steps_ = 0;
  Setpoint active_;
  double yaw_ = 0;
  std::deque<std::pair<long, Setpoint>> in_transit_;  // with the step of arrival
  std::vector<State> feedback_;                       // ring of the delayed estimates
  ThrustTerms thrust_terms_{std::span<const SimulationTerm>()};
  std::optional<double> voltage_;
};

}  // namespace backwash::sim
