// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>

#include "core/map/occupancy_grid.hpp"

namespace backwash::ctl {

/// The layer of voxels at height z (m, map): {z, low, resolution, size, runs}. `low`: its corner's x and y, m; `runs`:
/// content (0 unknown, 1 free, 2 occupied) and how many voxels in turn have it, alternating, x running fastest. Above
/// and below the map: the nearest layer.
nlohmann::json slice_of(const map::OccupancyGrid& grid, double z);

/// The voxels' layer that slice_of shows.
int layer_at(const map::OccupancyGrid& grid, double z);

}  // namespace backwash::ctl
