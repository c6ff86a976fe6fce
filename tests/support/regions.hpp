// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/map/occupancy_grid.hpp"

namespace backwash::test {

/// Number of the region of each voxel, in linear order: 1, 2, … for passable voxels that faces join, 0 for all others.
/// A flood apart from the planner's own. passable(v): whether a voxel may be passed, false outside the grid.
template <class Passable>
std::vector<int> regions(const map::OccupancyGrid& grid, Passable&& passable) {
  std::vector<int> region(grid.cell_count(), 0);
  int count = 0;
  for (std::size_t seed = 0; seed < region.size(); ++seed) {
    if (region[seed] != 0 || !passable(grid.voxel(seed))) continue;
    std::vector<Index3> open{grid.voxel(seed)};
    region[seed] = ++count;
    while (!open.empty()) {
      const Index3 v = open.back();
      open.pop_back();
      for (int axis = 0; axis < 3; ++axis)
        for (const int step : {-1, 1}) {
          const Index3 u = v + step * Index3::Unit(axis);
          if (!passable(u) || region[grid.linear(u)] != 0) continue;
          region[grid.linear(u)] = count;
          open.push_back(u);
        }
    }
  }
  return region;
}

}  // namespace backwash::test
