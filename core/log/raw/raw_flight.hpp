// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "core/log/columns/flight_log.hpp"
#include "core/log/raw/raw_log.hpp"

namespace backwash::log {

/// Whether a file begins as a raw log of the daemon, or as an MCAP file, which may hold one. False: it cannot be read.
bool is_raw_log(const std::string& path);

/// A raw log's ticks as a flight log (docs/interfaces.md): those that commanded a vehicle under way, each new odometry
/// once, from time 0 of its own stamps. Positions, velocities, attitude and set-points; a raw log holds no
/// accelerometer. `path`: of the log, for the error: bad_data if fewer than two ticks flew a set-point.
tl::expected<FlightLog, LogError> flight_of_raw_log(const RawLog& log, const std::string& path);

}  // namespace backwash::log
