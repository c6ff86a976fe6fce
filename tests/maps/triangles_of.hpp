// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "tests/maps/files.hpp"

namespace backwash::maps {

/// A tetrahedron, which each format says in its own words.
inline const Vec3 kCorners[] = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}};
inline constexpr int kFaces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

/// The corners of all triangles, sorted: formats number them in their own ways.
inline std::vector<std::array<double, 9>> triangles_of(const Geometry& geometry) {
  std::vector<std::array<double, 9>> all;
  for (const auto& t : geometry.triangles) {
    std::vector<std::array<double, 3>> corners;
    for (const auto c : t) corners.push_back({geometry.points[c].x(), geometry.points[c].y(), geometry.points[c].z()});
    std::ranges::sort(corners);
    std::array<double, 9> flat;
    for (std::size_t n = 0; n < 9; ++n) flat[n] = corners[n / 3][n % 3];
    all.push_back(flat);
  }
  std::ranges::sort(all);
  return all;
}

}  // namespace backwash::maps
