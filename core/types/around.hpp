// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <utility>
#include <vector>

#include "core/types/geometry.hpp"

namespace backwash {

inline constexpr double kNoSurface = std::numeric_limits<double>::infinity();  ///< m

/// What stands around a point, by the map.
struct Around {
  double height = kNoSurface;                  ///< to the first occupied voxel straight down, m
  double ceiling_gap = kNoSurface;             ///< … straight up, m
  std::vector<std::pair<double, Vec3>> walls;  ///< distance, m, and unit direction of each local minimum around, level
};

/// How far it is looked, m; 0: not at all.
struct Sight {
  double down = 20, up = 20, level = 3;
};

}  // namespace backwash
