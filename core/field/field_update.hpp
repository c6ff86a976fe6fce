// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "core/map/voxel_box.hpp"
#include "core/types/model.hpp"

namespace backwash::field {

/// The columns of a map, from its floor to its top, in which Σ may change when voxels of `changed` do: within the
/// model's ranges, and 3 voxels more for the normals and floors of the elements. Whole columns, so that WholeField
/// gives the same bits for a part of the map as for all of it.
map::VoxelBox affected_columns(const map::OccupancyGrid& grid, const Model& model, const map::VoxelBox& changed);

/// Those of `voxels` (linear indices of the grid) that lie in a box.
std::vector<std::size_t> voxels_within(const map::OccupancyGrid& grid, std::span<const std::size_t> voxels,
                                       const map::VoxelBox& box);

}  // namespace backwash::field
