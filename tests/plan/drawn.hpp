// SPDX-License-Identifier: BSD-3-Clause
// What tests of plans draw: boxes of voxels, random vectors.
#pragma once

#include <random>

#include "core/map/occupancy_grid.hpp"

namespace backwash::plan {

/// Every voxel of the box from `low` to `high` (m, map frame; on the faces of voxels) becomes `cell`.
inline void fill(map::OccupancyGrid& grid, const Vec3& low, const Vec3& high, map::Cell cell) {
  const Index3 a = grid.index(low + Vec3::Constant(1e-6)), b = grid.index(high - Vec3::Constant(1e-6));
  for (int k = a.z(); k <= b.z(); ++k)
    for (int j = a.y(); j <= b.y(); ++j)
      for (int i = a.x(); i <= b.x(); ++i) grid.set({i, j, k}, cell);
}

/// Each component uniform in [−size, size].
inline Vec3 random_vector(std::mt19937& random, double size) {
  std::uniform_real_distribution<double> u(-size, size);
  return {u(random), u(random), u(random)};
}

}  // namespace backwash::plan
