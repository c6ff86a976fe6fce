// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "core/types/geometry.hpp"
#include "core/types/simulation_term.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::sim {

/// What the rotors are told and what they say, 1 … 4.
struct RotorReadings {
  std::array<double, 4> motor;  ///< commands, 0 … 1
  std::array<double, 4> rpm;    ///< 1/min
};

/// Rotors, and an accelerometer on the body that they shake, with what an extended model says of them (docs/model.md
/// 6-16, 6-17). Without terms the four are alike and the accelerometer tells the truth.
class Sensors {
 public:
  /// `hover_rpm`: of the flight that is flown again; without it that of a rotor of thrust coefficient 0.025, T = C_T ρ
  /// A (Ω r)². `seed`: of noise and dropouts.
  Sensors(const Vehicle& vehicle, std::span<const SimulationTerm> terms, std::optional<double> hover_rpm,
          std::uint64_t seed);
  /// Turns the rotors for dt (s) at a thrust per mass, m/s².
  void step(double thrust_acc, double dt);
  /// What the accelerometer says of `acceleration_W`, m/s² in W, gravity removed. `t`: s since the flight's start;
  /// `temperature`: of the sensor, °C; without it the course that the term itself holds.
  Vec3 acceleration(const Vec3& acceleration_W, double yaw, double t, std::optional<double> temperature);
  RotorReadings rotors();

 private:
  Vehicle vehicle_;
  std::vector<SimulationTerm> terms_;
  double hover_rpm_;
  std::array<double, 4> needs_{}, reads_{}, missing_{}, lines_{};  // ln, ln, share, m/s²
  std::array<double, 4> built_{};                                  // relative rates, where they have lines
  double floor_ = 0;                                               // m/s²
  std::array<double, 4> phase_{0.3, 1.9, 4.0, 5.5};
  double thrust_acc_ = kGravity;
  std::mt19937_64 rng_;
  std::normal_distribution<double> normal_;
};

}  // namespace backwash::sim
