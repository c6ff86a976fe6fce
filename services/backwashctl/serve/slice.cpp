// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashctl/serve/slice.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::ctl {

int layer_at(const map::OccupancyGrid& grid, double z) {
  const double layer = std::floor((z - grid.origin().z()) / grid.resolution());
  return static_cast<int>(std::clamp(layer, 0.0, static_cast<double>(grid.size().z() - 1)));
}

nlohmann::json slice_of(const map::OccupancyGrid& grid, double z) {
  const int layer = layer_at(grid, z);
  std::vector<long> runs;
  for (int j = 0; j < grid.size().y(); ++j)
    for (int i = 0; i < grid.size().x(); ++i) {
      const long cell = static_cast<long>(grid.at(Index3(i, j, layer)));
      if (runs.empty() || runs[runs.size() - 2] != cell) runs.insert(runs.end(), {cell, 0});
      ++runs.back();
    }
  return {{"z", grid.center({0, 0, layer}).z()},
          {"low", {grid.origin().x(), grid.origin().y()}},
          {"resolution", grid.resolution()},
          {"size", {grid.size().x(), grid.size().y()}},
          {"runs", std::move(runs)}};
}

}  // namespace backwash::ctl
