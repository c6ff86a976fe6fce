// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "core/map/voxel_box.hpp"
#include "services/backwashd/map/map_news.hpp"

namespace backwash::daemon {

bool same_place(const map::OccupancyGrid& a, const map::OccupancyGrid& b);

/// Around all voxels that differ between two grids of the same place.
map::VoxelBox difference(const map::OccupancyGrid& before, const map::OccupancyGrid& after);

/// What is free before and is not wholly free after, by place: the grids may have any extent, origin and resolution,
/// and outside of a grid nothing is free. Boxes of the lattice of `before`, where anything is free after in none of
/// them; larger cubes of that lattice only where kMost are not enough. O(voxels).
NewVoxels news(const map::OccupancyGrid& before, const map::OccupancyGrid& after, std::int64_t received_ns);

/// Those of the voxels of a grid that are free in it, as boxes in the same way: none holds a voxel that is not listed.
/// O(voxels within their bounds).
NewVoxels news(const map::OccupancyGrid& before, std::span<const Index3> not_free, std::int64_t received_ns);

}  // namespace backwash::daemon
