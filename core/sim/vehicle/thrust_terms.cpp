// SPDX-License-Identifier: BSD-3-Clause
#include "core/sim/vehicle/thrust_terms.hpp"

#include <algorithm>
#include <cmath>

#include "core/types/geometry.hpp"

namespace backwash::sim {
namespace {

using Kind = SimulationTerm::Kind;

/// 1 − s (V* − V)/V_m.
double sagging(const std::vector<double>& x, double t, std::optional<double> voltage) {
  const double volts = voltage.value_or(x[3] + x[4] * t);
  return std::clamp(1 - x[0] * (x[1] - volts) / x[2], 0.1, 2.0);
}

/// Of the first number of all terms of a kind.
double sum_of(std::span<const SimulationTerm> terms, Kind kind) {
  double sum = 0;
  for (const auto& term : terms)
    if (term.is(kind)) sum += term.value[0];
  return sum;
}

}  // namespace

ThrustTerms::ThrustTerms(std::span<const SimulationTerm> terms) {
  for (const auto& term : terms) {
    if (term.is(Kind::thrust_share) || term.is(Kind::thrust_slope) || term.is(Kind::thrust_with_voltage) ||
        term.is(Kind::thrust_lag))
      terms_.push_back(term);
    if (term.is(Kind::thrust_lag)) lag_ += term.value[0];
  }
}

double ThrustTerms::step(double nominal, double t, std::optional<double> voltage, double dt) {
  double slope = 1, factor = 1;
  for (const auto& term : terms_) {
    if (term.is(Kind::thrust_slope)) slope += term.value[0];
    if (term.is(Kind::thrust_share)) factor *= 1 - term.value[0];
    if (term.is(Kind::thrust_with_voltage)) factor *= sagging(term.value, t, voltage);
  }
  const double wanted = std::max(0.0, factor * (kGravity + slope * (nominal - kGravity)));
  if (!(lag_ > 0)) return wanted;
  lagged_ = wanted + std::exp(-dt / lag_) * (lagged_.value_or(wanted) - wanted);
  return *lagged_;
}

double setpoint_delay(std::span<const SimulationTerm> terms) { return sum_of(terms, Kind::setpoint_delay); }
double more_attitude_lag(std::span<const SimulationTerm> terms) { return sum_of(terms, Kind::attitude_lag); }

Vehicle::HorizontalVertical least_integrator(std::span<const SimulationTerm> terms,
                                             const Vehicle::HorizontalVertical& kd) {
  Vehicle::HorizontalVertical ki{0, 0};
  for (const auto& term : terms) {
    if (!term.is(Kind::shift_decay)) continue;
    ki.horizontal = std::max(ki.horizontal, term.value[0] * kd.horizontal);
    ki.vertical = std::max(ki.vertical, term.value[1] * kd.vertical);
  }
  return ki;
}

}  // namespace backwash::sim
