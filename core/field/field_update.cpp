// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/field_update.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/field/whole_field.hpp"

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

void evaluate_columns(const map::OccupancyGrid& grid, const Model& model, const map::VoxelBox& columns,
                      std::span<const std::size_t> listed,
                      const std::function<void(const Index3&, const Variance&)>& store, const Parallel& parallel) {
  map::VoxelBox around = affected_columns(grid, model, columns);
  if (model.unknown_floor) around.low.z() = -1;  // what is below the map is unknown, too
  const map::OccupancyGrid part = map::part_of(grid, around);
  std::vector<std::size_t> of_part;
  of_part.reserve(listed.size());
  for (const std::size_t n : listed) of_part.push_back(part.linear(grid.voxel(n) - around.low));
  const WholeField sweep(part, model, of_part);
  parallel(sweep.block_count(), [&](std::size_t begin, std::size_t end) {
    sweep.evaluate(begin, end, [&](std::size_t n, const Variance& s) { store(part.voxel(n) + around.low, s); });
  });
}

}  // namespace backwash::field
