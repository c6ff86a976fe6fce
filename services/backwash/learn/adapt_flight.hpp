// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "core/adapt/in_flight.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/types/model.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::services {

/// A flight as core/adapt takes it, at the daemon's rate: set-points as they were held, the newest position of each
/// tick.
struct FlownAir {
  std::vector<adapt::AirTick> ticks;
  std::size_t rows = 0, left_out = 0;  ///< that are used; standing, frozen or saturated
  bool attitude = true;                ///< logged; else every tick is of no class
  bool accelerometer = true;           ///< logged; nothing is taken from it
};

/// Reads a flight log (CSV, ULog, DataFlash) or the daemon's raw log (.mcap). `grid` may be null: the map in the
/// raw log, else no surface but the floor z = 0. Throws Failure: 66 for what does not exist, 65 for a log that cannot
/// be used.
FlownAir read_air(const std::string& path, const Vehicle& vehicle, const Model& model, const map::OccupancyGrid* grid);

}  // namespace backwash::services
