// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <array>

#include "core/types/state.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::bench {

/// A quadrotor as its rotors move it, for a real controller that commands rotors: a flat disc of the vehicle file's
/// mass and radius with four rotors as an X at its edge, first-order rotor lag, drag, and the ground. Frames: W z-up;
/// body x forward, y left, z up. Integrated at 1 kHz.
///
///   J ω̇ = Σ r_i × T_i e_z ± κ T_i e_z − ω × J ω,   m v̇ = R Σ T_i e_z − c v + m (w − g e_z)
class Airframe {
 public:
  static constexpr double kStep = 1e-3;       ///< s
  static constexpr double kRotorLag = 0.03;   ///< s
  static constexpr double kYawMoment = 0.05;  ///< κ, m: moment of a rotor over its thrust (CA_ROTORn_KM of PX4)
  static constexpr double kDrag = 0.2;        ///< c, N per m/s

  /// Stands at `ground_W` (its centre), heading along x, rotors off.
  Airframe(const Vehicle& vehicle, const Vec3& ground_W);

  /// Rotor commands, 0 … 1 by the vehicle's thrust curve, in PX4's order: front right and rear left, which turn
  /// counter-clockwise, front left and rear right.
  using Rotors = std::array<double, 4>;
  /// One kStep under these commands and the disturbance acceleration w_W, m/s².
  void step(const Rotors& commands, const Vec3& w_W);

  const State& state() const noexcept { return state_; }
  const Eigen::Quaterniond& attitude() const noexcept { return attitude_; }
  const Vec3& rates() const noexcept { return rates_; }                ///< body, rad/s
  const Vec3& acceleration() const noexcept { return acceleration_; }  ///< m/s², W, gravity removed
  /// What accelerometers feel, body, m/s².
  Vec3 specific_force() const;
  bool on_ground() const noexcept { return on_ground_; }
  /// Sum of the rotors' thrust over the largest there is.
  double thrust() const noexcept;
  /// Distance of each rotor from the centre along x and along y, m.
  double arm() const noexcept { return arm_; }

 private:
  double commanded(double u) const noexcept;

  Vehicle vehicle_;
  double floor_, arm_;
  Vec3 inertia_;
  State state_;
  Eigen::Quaterniond attitude_{1, 0, 0, 0};
  Vec3 rates_ = Vec3::Zero(), acceleration_ = Vec3::Zero();
  Rotors thrust_{};
  bool on_ground_ = true;
};

}  // namespace backwash::bench
