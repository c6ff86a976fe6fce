// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/sim/flight.hpp"

namespace backwash::sim {

/// A logged flight as it can be flown again: its set-points, and what a simulation takes as given.
struct LoggedFlight {
  std::vector<double> t_s;                  ///< of the rows, rising, from 0
  std::vector<std::size_t> row;             ///< the log's row of each
  std::vector<Setpoint> commands;           ///< one per row; the yaw is the heading that was measured
  std::vector<std::optional<int>> segment;  ///< hover position number; none in transit and without the column
  State start;                              ///< measured at the first row
  /// The battery's voltage and the sensor's temperature by row, as parabolas of time: the momentary ones answer the
  /// thrust. Empty where the log does not tell them.
  std::vector<double> voltage, temperature;
  std::optional<double> hover_rpm;  ///< of the median rotor
};

/// Reads it from a log (docs/interfaces.md, "Flight log, CSV"). Rows whose stamp does not rise are left out;
/// set-points' velocities and accelerations that are not logged are 0. Error, with `path` in its line: a log without
/// x_m y_m z_m or cmd_x_m cmd_y_m cmd_z_m, or with fewer than 2 rows.
tl::expected<LoggedFlight, log::LogError> logged_flight(const log::FlightLog& log, const Vehicle& vehicle,
                                                        const std::string& path);

/// Flies the set-points again, with a row at each of the log's stamps. Between two rows a set-point is interpolated and
/// acts a quarter of a period later: held from its row on or streamed all along, no log tells. Over gaps of more than
/// 0.1 s it is held. Deterministic for its seed.
std::vector<FlightSample> fly_setpoints(const map::OccupancyGrid& grid, const Vehicle& vehicle,
                                        const LoggedFlight& flight, std::uint64_t seed, Simulation simulation);

/// The log of a flight that was flown again: motors and rpm too, and battery, temperature and the columns that say
/// where and when it was flown as the first log has them.
log::FlightLog to_log(const std::vector<FlightSample>& samples, const LoggedFlight& flight, const log::FlightLog& from);

}  // namespace backwash::sim
