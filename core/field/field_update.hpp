// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/map/voxel_box.hpp"
#include "core/types/model.hpp"

namespace backwash::field {

/// The columns of a map, from its floor to its top, in which Σ may change when voxels of `changed` do: within the
/// model's ranges, and 3 voxels more for the normals and floors of the elements. Whole columns, so that WholeField
/// gives the same bits for a part of the map as for all of it.
map::VoxelBox affected_columns(const map::OccupancyGrid& grid, const Model& model, const map::VoxelBox& changed);

}  // namespace backwash::field
