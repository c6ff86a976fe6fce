// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "core/map/occupancy_grid.hpp"

namespace backwash::sim {

/// Distance from p along the unit vector `direction` to the first occupied voxel, m; nothing if there is none within
/// `range` (m). 0 inside an occupied voxel. Unknown cells do not stop the air. O(range/a).
std::optional<double> cast_ray(const map::OccupancyGrid& grid, const Vec3& p_W, const Vec3& direction, double range);

}  // namespace backwash::sim
