// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/map/occupancy_grid.hpp"
#include "core/types/model.hpp"

namespace backwash::field {

/// Box of voxels, both ends included.
struct VoxelBox {
  Index3 low, high;
  bool contains(const Index3& v) const noexcept {
    return (v.array() >= low.array()).all() && (v.array() <= high.array()).all();
  }
};

/// The smallest box that holds every voxel in which two maps differ: none if they are equal. Nothing that could be said
/// of maps with another origin, edge or size: the box is then the whole of `after`. O(cells).
std::optional<VoxelBox> changed_box(const map::OccupancyGrid& before, const map::OccupancyGrid& after);

/// The columns of a map, from its floor to its top, in which Σ may change when voxels of `changed` do: within the
/// model's ranges, and 3 voxels more for the normals and floors of the elements. Whole columns, so that WholeField
/// gives the same bits for a part of the map as for all of it.
VoxelBox affected_columns(const map::OccupancyGrid& grid, const Model& model, const VoxelBox& changed);

/// Those of `voxels` (linear indices of the grid) that lie in a box.
std::vector<std::size_t> voxels_within(const map::OccupancyGrid& grid, std::span<const std::size_t> voxels,
                                       const VoxelBox& box);

}  // namespace backwash::field
