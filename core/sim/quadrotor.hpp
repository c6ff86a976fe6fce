// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <deque>

#include "core/types/state.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::sim {

/// Quadrotor with its own position/velocity/acceleration controller, thrust and tilt limits and first-order attitude lag,
/// integrated at 1 kHz. Frames: W z-up; body x forward, y left, z up.
class Quadrotor {
 public:
  static constexpr double kStep = 1e-3;  ///< s

  /// At rest on the ground or hovering at `start`.
  Quadrotor(const Vehicle& vehicle, const State& start);
  /// Issues a set-point; it reaches the controller `latency` later.
  void command(const Setpoint& setpoint);
  /// One kStep. `w_W`: disturbance acceleration, m/s². `estimated`: what the controller believes its state is.
  void step(const Vec3& w_W, const State& estimated);

  double time() const noexcept { return time_; }
  const State& state() const noexcept { return state_; }
  const Vec3& acceleration() const noexcept { return acceleration_; }  ///< m/s², W, gravity removed, disturbance included
  Eigen::Quaterniond attitude() const;                                 ///< body to world
  double thrust() const noexcept;                                      ///< normalised collective command u, 0..1

 private:
  Vehicle vehicle_;
  State state_;
  Vec3 acceleration_ = Vec3::Zero();
  Vec3 produced_ = Vec3::Zero();  // acceleration the rotors produce, gravity removed
  double time_ = 0;
  Setpoint active_;
  double yaw_ = 0;
  std::deque<std::pair<double, Setpoint>> in_transit_;
  std::deque<State> feedback_;
};

}  // namespace backwash::sim
