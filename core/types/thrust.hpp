// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "core/types/vehicle.hpp"

namespace backwash {

/// Share of the largest thrust that a normalised command u gives, T(u)/max_thrust = f u² + (1 − f) u.
inline double thrust_share(const Vehicle& vehicle, double u) {
  const double f = vehicle.propulsion.thr_mdl_fac;
  return f * u * u + (1 - f) * u;
}

/// The command that gives this share. Precondition: share ≥ 0.
inline double thrust_command(const Vehicle& vehicle, double share) noexcept {
  const double f = vehicle.propulsion.thr_mdl_fac;
  return f > 0 ? (std::sqrt((1 - f) * (1 - f) + 4 * f * share) - (1 - f)) / (2 * f) : share;
}

}  // namespace backwash
