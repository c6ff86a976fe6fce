// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <span>

#include "core/map/voxel_box.hpp"
#include "core/types/model.hpp"
#include "core/types/parallel.hpp"

namespace backwash::field {

/// The columns of a map, from its floor to its top, in which Σ may change when voxels of `changed` do: within the
/// model's ranges, and 3 voxels more for the normals and floors of the elements. Whole columns, so that WholeField
/// gives the same bits for a part of the map as for all of it.
map::VoxelBox affected_columns(const map::OccupancyGrid& grid, const Model& model, const map::VoxelBox& changed);

/// Σ at the listed voxels (linear indices) of whole columns, from what can reach them alone: the bits of the whole map.
/// Calls store(voxel, Σ) once for each, possibly from several threads.
void evaluate_columns(const map::OccupancyGrid& grid, const Model& model, const map::VoxelBox& columns,
                      std::span<const std::size_t> listed,
                      const std::function<void(const Index3&, const Variance&)>& store, const Parallel& parallel);

}  // namespace backwash::field
