// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/types/simulation_term.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::sim {

/// What the rotors give for a commanded thrust by an extended model (docs/model.md 6-13 to 6-15): its share, its slope
/// about hover, its sag with the battery's voltage, its lag. Without such terms: what was commanded.
class ThrustTerms {
 public:
  explicit ThrustTerms(std::span<const SimulationTerm> terms);
  bool none() const noexcept { return terms_.empty(); }
  /// Thrust per mass over the next dt (s), m/s², when the simulation without terms gives `nominal`. `t`: s since the
  /// flight's start; `voltage`: of the battery, V; without it the course that the term itself holds.
  double step(double nominal, double t, std::optional<double> voltage, double dt);

 private:
  std::vector<SimulationTerm> terms_;
  double lag_ = 0;                // s
  std::optional<double> lagged_;  // m/s²
};

/// By how much set-points act later than the vehicle file says, s.
double setpoint_delay(std::span<const SimulationTerm> terms);
/// By how much the attitude lags longer than the vehicle file says, s.
double more_attitude_lag(std::span<const SimulationTerm> terms);
/// Least gain k_i of the velocity loop's integrator, 1/s²: of decays at the terms' fastest rate (docs/model.md 6-15b).
Vehicle::HorizontalVertical least_integrator(std::span<const SimulationTerm> terms,
                                             const Vehicle::HorizontalVertical& kd);

}  // namespace backwash::sim
