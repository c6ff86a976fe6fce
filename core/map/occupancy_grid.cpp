// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/occupancy_grid.hpp"

namespace backwash::map {

OccupancyGrid::OccupancyGrid(const Vec3& origin_W, double resolution, const Index3& size, Cell fill)
    : origin_W_(origin_W),
      resolution_(resolution),
      size_(size),
      cells_(
          static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y()) * static_cast<std::size_t>(size.z()),
          fill) {}

}  // namespace backwash::map
