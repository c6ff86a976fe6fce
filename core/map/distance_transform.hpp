// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "core/map/shared_rows.hpp"

namespace backwash::map {

/// Squared distances to obstacles in half voxels are stored up to this, 127.999 voxels; larger ones as this.
inline constexpr std::uint32_t kFarthestSquared = 0xffff;

/// Most steps from a voxel of a grid to the nearest obstacle that matter: no side is farther, and none counts beyond
/// kFarthestSquared.
int most_steps(const Index3& size) noexcept;

/// For each voxel of a box inside the grid: squared distance from its centre to the nearest obstacle box (anything that
/// is not free, or outside), half voxels, into `squared`. Exact integers, so that the bits do not depend on the box.
/// Precondition: `squared` owns the box's rows. O(voxels of the box grown by most_steps), times the distance.
void transform_distances(const OccupancyGrid& grid, const VoxelBox& box, SharedRows<std::uint16_t>& squared);

}  // namespace backwash::map
