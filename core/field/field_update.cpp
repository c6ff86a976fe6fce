// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/field_update.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::field {

map::VoxelBox affected_columns(const map::OccupancyGrid& grid, const Model& model, const map::VoxelBox& changed) {
  const auto& g = model.ground;
  const double a = grid.resolution(), cone = g.l_max * (g.theta_max < 1.5 ? std::sin(g.theta_max) : 1.0);
  const double ground = std::max(cone, std::min(g.r0, g.l_footprint_max)) / a + 1;
  const double lateral = model.wall.l_max / a + 0.5 + 3;
  const int reach = static_cast<int>(std::ceil(std::max(ground, lateral) + 1e-6));
  map::VoxelBox box{changed.low - Index3(reach, reach, 0), changed.high + Index3(reach, reach, 0)};
  box.low = box.low.cwiseMax(0);
  box.high = box.high.cwiseMin(grid.size() - Index3::Ones());
  box.low.z() = 0;
  box.high.z() = grid.size().z() - 1;
  return box;
}

}  // namespace backwash::field
