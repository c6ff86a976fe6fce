// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

#include "core/map/occupancy_grid.hpp"

namespace backwash::map {

/// Voxels from low to high, both included; starts empty.
struct VoxelBox {
  Index3 low = Index3::Constant(std::numeric_limits<int>::max());
  Index3 high = Index3::Constant(std::numeric_limits<int>::min());

  bool empty() const noexcept { return (low.array() > high.array()).any(); }
  bool contains(const Index3& v) const noexcept {
    return (v.array() >= low.array()).all() && (v.array() <= high.array()).all();
  }
  void add(const Index3& v) noexcept {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
};

/// The voxels of a box within the grid as a grid of their own, at the same place.
OccupancyGrid part_of(const OccupancyGrid& grid, const VoxelBox& box);

}  // namespace backwash::map
