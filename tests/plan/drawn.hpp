// SPDX-License-Identifier: BSD-3-Clause
// What tests of plans share: a vehicle, boxes of voxels, random vectors.
#pragma once

#include <random>

#include "core/map/occupancy_grid.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::plan {

inline Vehicle test_vehicle() {
  Vehicle v;
  v.body = {0.16, 0.18, 0.0635, 0.9};
  v.controller = {{10, 12}, {5.5, 6}, 0.02, 0, 0.05};
  v.estimation.position = 0.02;
  v.limits = {1.5, 2};
  v.initial_error = {0.02, 0.05};
  return v;
}

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
