// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <random>

#include "core/map/occupancy_grid.hpp"

namespace backwash::map {

/// Grid of random size up to `largest` per axis, at a random corner on the lattice of its resolution, from almost empty
/// to almost full, with boxes of one content (so that octrees prune) and single cells.
inline OccupancyGrid random_grid(std::mt19937_64& random, int largest) {
  const auto below = [&](int n) { return static_cast<int>(random() % static_cast<std::uint64_t>(n)); };
  const double resolution = std::array{0.05, 0.08, 0.1, 0.25}[random() % 4];
  const Index3 size(1 + below(largest), 1 + below(largest), 1 + below(largest));
  const Index3 corner(below(40) - 20, below(40) - 20, below(40) - 20);
  OccupancyGrid grid(resolution * corner.cast<double>(), resolution, size, static_cast<Cell>(below(3)));
  for (int boxes = below(4); boxes > 0; --boxes) {
    const Index3 low(below(size.x()), below(size.y()), below(size.z()));
    const Index3 high = (low + Index3(1 + below(8), 1 + below(8), 1 + below(8))).cwiseMin(size);
    const auto cell = static_cast<Cell>(below(3));
    for (int k = low.z(); k < high.z(); ++k) {
      for (int j = low.y(); j < high.y(); ++j) {
        for (int i = low.x(); i < high.x(); ++i) grid.set({i, j, k}, cell);
      }
    }
  }
  const int density = 1 + below(40);  // one cell in `density` is drawn anew
  for (std::size_t i = 0; i < grid.cell_count(); ++i) {
    if (below(density) == 0 && below(4) == 0) grid.set(grid.voxel(i), static_cast<Cell>(below(3)));
  }
  return grid;
}

}  // namespace backwash::map
