// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "core/adapt/adaptation.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/types/model.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::services {

/// The air of a flight, as core/adapt takes it.
struct FlownAir {
  std::vector<adapt::AirSample> samples;
  Vec3 noise = Vec3::Zero();  ///< of the sensor, variance per sample, (m/s²)²
  std::size_t left_out = 0;   ///< rows: not free by the map, standing, frozen, saturated, or before delays have passed
  bool attitude = true;       ///< logged; else every sample is of no class
  bool accelerometer = true;  ///< logged; else velocities were differentiated
};

/// Reads a flight log (CSV, ULog, DataFlash) or the daemon's raw log (.bwlog). `grid` may be null: the map in the
/// raw log, else no surface but the floor z = 0. Throws Failure: 66 for what does not exist, 65 for a log that cannot
/// be used.
FlownAir read_air(const std::string& path, const Vehicle& vehicle, const Model& model, const map::OccupancyGrid* grid);

}  // namespace backwash::services
