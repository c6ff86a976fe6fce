// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "core/log/columns/flight_log.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/study/findings/residuals.hpp"
#include "core/types/model.hpp"
#include "core/types/simulation_term.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::services {

/// Flights that were measured, in the order of their observations, and what they were flown with.
struct FlownAgain {
  struct Flight {
    const log::FlightLog& log;
    std::string path;
    const map::OccupancyGrid& grid;
  };
  std::vector<Flight> flights;
  const Vehicle& vehicle;
  const Model& model;
  std::uint64_t seed;
};

/// What the simulation in the model's own air, with these terms, says of each measured window: mean over four flights
/// with other gusts. Throws Failure 65 for a log without set-points. On all processors.
study::Told simulated(const FlownAgain& again, const std::vector<SimulationTerm>& terms,
                      const study::Observations& measured);

}  // namespace backwash::services
