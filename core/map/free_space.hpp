// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <span>

#include "core/map/occupancy_grid.hpp"

namespace backwash::map {

/// What a flood made of a grid.
struct Flood {
  std::size_t freed = 0;  ///< voxels that were unknown before
  /// Where the flood first met the grid's faces −x, +x, −y, +y, −z, +z: beyond them nothing is known.
  std::array<std::optional<Index3>, 6> edge;
};

/// Makes every unknown voxel free that a way through faces of voxels joins to a seed without passing an occupied one.
/// Precondition: each seed is inside the grid and not occupied. O(cells).
Flood flood_free(OccupancyGrid& grid, std::span<const Index3> seeds);

/// Voxels that rays made free: what they held before.
struct SeenThrough {
  std::size_t unknown = 0, occupied = 0;
};

/// Makes every unknown voxel free that a ray from the sensor to a point passes (m, W); the point's own voxel is not
/// passed, and what lies outside the grid is not asked. An occupied one becomes free where LiveMap frees it: later
/// scans have seen through it, so that who walked by is no wall. `sensors_W`: one for all points, or one each, where
/// successive equal ones are a scan. Precondition: sensors inside the grid, rays shorter than 1 km. O(points ·
/// range/a).
SeenThrough free_by_rays(OccupancyGrid& grid, std::span<const Vec3> points_W, std::span<const Vec3> sensors_W);

}  // namespace backwash::map
