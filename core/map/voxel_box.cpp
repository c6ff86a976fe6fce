// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/voxel_box.hpp"

namespace backwash::map {

OccupancyGrid part_of(const OccupancyGrid& grid, const VoxelBox& box) {
  const Vec3 origin_W = grid.origin() + grid.resolution() * box.low.cast<double>();
  const Index3 size = box.high - box.low + Index3::Ones();
  OccupancyGrid part(origin_W, grid.resolution(), size);
  for (int k = 0; k < size.z(); ++k)
    for (int j = 0; j < size.y(); ++j)
      for (int i = 0; i < size.x(); ++i) part.set({i, j, k}, grid.at(box.low + Index3(i, j, k)));
  return part;
}

}  // namespace backwash::map
