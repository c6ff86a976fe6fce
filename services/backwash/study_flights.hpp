// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/log/flight_log.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/study/windows/observation.hpp"
#include "core/types/model.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::services {

/// PX4's or ArduPilot's own log, by its name.
bool is_autopilots_log(const std::string& path);

/// A flight log: ULog (.ulg) or DataFlash (.bin) by its name, else CSV. Throws Failure.
log::FlightLog read_flight(const std::string& path);

/// The same for a study, which needs positions: without the columns of sensors that never spoke. A table that no flight
/// can be (core/log, impossible()) is refused. Throws Failure.
log::FlightLog read_studied(const std::string& path);

/// The flights of a study, each once.
struct Flights {
  std::vector<std::string> paths;
  std::vector<log::FlightLog> logs;
  std::vector<double> group;  ///< value of the column that they are grouped by in each one's first row; empty: none
  std::vector<std::pair<std::string, std::string>> twice;  ///< left out, and which flight it is again
  /// Numbers of the flights, those of one group behind each other.
  std::vector<std::size_t> order() const;
};

/// Reads them and leaves out those that hold another one's positions. `group`: a column, or empty. Throws Failure.
Flights read_flights(const std::vector<std::string>& paths, const std::string& group);
/// Leaves out those with another one's gusts, too, and makes windows of the others. `grid` may be null.
study::Observations observe(Flights& flights, const Vehicle& vehicle, const Model& model,
                            const map::OccupancyGrid* grid);

}  // namespace backwash::services
