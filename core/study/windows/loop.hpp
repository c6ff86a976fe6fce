// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/log/columns/flight_log.hpp"
#include "core/study/windows/signals/series.hpp"
#include "core/types/vehicle.hpp"

/// The position loop of a vehicle file, driven by what a log holds.
namespace backwash::study {

/// Columns of a vector in these rows of a log. Precondition: it has them.
std::vector<Vec3> vectors(const log::FlightLog& log, const std::vector<std::size_t>& rows, const std::string& prefix,
                          const std::string& unit);

/// The set-points of a flight: absent velocities and accelerations are zero (docs/interfaces.md). Precondition: it has
/// positions among them.
struct Commands {
  std::vector<Vec3> p, v, a;
};
Commands commands_of(const log::FlightLog& log, const std::vector<std::size_t>& rows);

struct LoopMotion {
  std::vector<Vec3> p, v, a;
};
/// The controller's loop at each row: fed with the logged state, or (`closed`) with its own, against a level drag, 1/s.
LoopMotion loop_of(const Series& s, const Commands& cmd, const Vehicle& vehicle, bool closed, double drag = 0);

/// What the loop answers to the logged state, joined between rows as the controller saw it, by each attitude lag, s.
std::vector<std::vector<Vec3>> answers(const Series& s, const Commands& cmd, const Vehicle& vehicle,
                                       std::span<const double> lags);

}  // namespace backwash::study
