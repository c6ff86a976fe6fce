// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "core/log/columns/flight_log.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::study {

/// Shares of a flight's samples, 0 … 1, at places where a map lets no craft be (docs/model.md, 3-10).
struct MapShare {
  double inside = 0;    ///< in an occupied voxel
  double too_near = 0;  ///< nearer to one, at the same height, than the body reaches
  double outside = 0;   ///< outside of the map, or where it knows nothing
  struct Sample {
    double t_s;  ///< as in the log
    Vec3 p_W;
  };
  std::optional<Sample> first = {};  ///< of them
  double all() const noexcept { return inside + too_near + outside; }
  /// More than kWindowRules.misplaced: another map, or another frame.
  bool refused() const noexcept;
};

/// Looks at every row that has a place. A voxel's edge and the vehicle's `estimation.position` are allowed for, along z
/// and off the body's radius. Precondition: x_m, y_m, z_m. O(rows · voxels of the body's disc).
MapShare map_share(const log::FlightLog& log, const map::OccupancyGrid& grid, const Vehicle& vehicle);

/// "0.4 % inside of something, 0.1 % too near for its body, 0.0 % outside of the map".
std::string to_text(const MapShare& share);

}  // namespace backwash::study
