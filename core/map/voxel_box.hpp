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

/// Calls visit(v) for the voxels of a box, x fastest.
template <class Visit>
void for_each_voxel(const VoxelBox& box, const Visit& visit) {
  for (int k = box.low.z(); k <= box.high.z(); ++k)
    for (int j = box.low.y(); j <= box.high.y(); ++j)
      for (int i = box.low.x(); i <= box.high.x(); ++i) visit(Index3(i, j, k));
}

/// The voxels of a grid of that size.
inline VoxelBox all_of(const Index3& size) noexcept { return {Index3::Zero(), size - Index3::Ones()}; }

/// The voxels that two boxes share.
inline VoxelBox common(const VoxelBox& a, const VoxelBox& b) noexcept {
  return {a.low.cwiseMax(b.low), a.high.cwiseMin(b.high)};
}

/// The voxels of a box within the grid as a grid of their own, at the same place.
OccupancyGrid part_of(const OccupancyGrid& grid, const VoxelBox& box);

}  // namespace backwash::map
