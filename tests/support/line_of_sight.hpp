// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/field/sight/sight.hpp"

namespace backwash::field {

/// Whether the segment from p to c, its last 2a left out, meets no occupied voxel (docs/model.md section 1, "Visible"),
/// voxel by voxel: what SightMap has to answer. O(|c − p|/a).
inline bool line_of_sight(const map::OccupancyGrid& grid, const Vec3& p_W, const Vec3& c_W) noexcept {
  const auto segment = open_part(grid.origin(), grid.resolution(), p_W, c_W);
  return !segment || clear(*segment, [&](const Index3& v) { return grid.occupied(v) ? 0 : 1; });
}

}  // namespace backwash::field
