// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/map/voxel_box.hpp"

namespace backwash::test {

/// The smallest box that holds every voxel in which two maps of one size differ; empty if they are equal.
inline map::VoxelBox changed_box(const map::OccupancyGrid& before, const map::OccupancyGrid& after) {
  map::VoxelBox box;
  for (std::size_t n = 0; n < after.cell_count(); ++n)
    if (before.at(n) != after.at(n)) box.add(after.voxel(n));
  return box;
}

}  // namespace backwash::test
