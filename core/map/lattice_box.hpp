// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <tl/expected.hpp>

#include "core/map/occupancy_grid.hpp"

namespace backwash::map {

/// Voxels of the largest grid that is made of somebody's file: what load_octomap takes, a byte a voxel.
inline constexpr std::size_t kMostVoxels = std::size_t{512} << 20;

/// Share of a voxel within which a coordinate counts as lying on a face: single-precision coordinates of a building and
/// turns given with five digits are off by less.
inline constexpr double kOnFace = 1e-3;

/// An unknown grid over the box from low to high (m, W) whose corner is a multiple of `resolution` (m), as OctoMap
/// wants it: outer voxels hold the box's faces. A face within kOnFace of the voxels' faces adds no voxel, and a box
/// without extent along an axis is one voxel there. Errors, one sentence without a file's name: more than `most` voxels
/// (what would fit), or farther from the origin than OctoMap's keys reach (which origin would do).
tl::expected<OccupancyGrid, std::string> grid_around(const Vec3& low_W, const Vec3& high_W, double resolution,
                                                     std::size_t most = kMostVoxels);

}  // namespace backwash::map
