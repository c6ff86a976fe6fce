// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/free_space.hpp"

#include <vector>

#include "core/map/scan/scan.hpp"

namespace backwash::map {

Flood flood_free(OccupancyGrid& grid, std::span<const Index3> seeds) {
  Flood flood;
  std::vector<char> met(grid.cell_count());
  std::vector<Index3> front, next;
  const auto meet = [&](const Index3& v) {
    const std::size_t n = grid.linear(v);
    if (met[n] || grid.occupied(v)) return;
    met[n] = 1;
    if (grid.at(n) == Cell::unknown) {
      grid.set(v, Cell::free);
      ++flood.freed;
    }
    next.push_back(v);
  };
  for (const Index3& seed : seeds) meet(seed);
  while (!next.empty()) {  // one front after the other: what waits is a surface, not a volume
    front.swap(next);
    next.clear();
    for (const Index3& v : front) {
      for (int side = 0; side < 6; ++side) {
        Index3 beside = v;
        beside[side / 2] += side % 2 ? 1 : -1;
        auto& edge = flood.edge[static_cast<std::size_t>(side)];
        if (grid.inside(beside)) {
          meet(beside);
        } else if (!edge) {
          edge = v;
        }
      }
    }
  }
  return flood;
}

SeenThrough free_by_rays(OccupancyGrid& grid, std::span<const Vec3> points_W, std::span<const Vec3> sensors_W) {
  constexpr double kLongest = 999;  // m, of LiveMap::insert
  // A choice, by free_space_test.cpp: 15 leave a fiftieth of who walked by; 30 twice that, and 7 a sixth less of what
  // stands.
  constexpr int kMisses = 15;
  LiveMap seen(grid);
  const bool each = sensors_W.size() == points_W.size();
  for (std::size_t begin = 0, end = 0; begin < points_W.size(); begin = end) {
    end = each ? begin + 1 : points_W.size();
    while (end < points_W.size() && sensors_W[end] == sensors_W[begin]) ++end;
    seen.insert(points_W.subspan(begin, end - begin), sensors_W[each ? begin : 0], kLongest, kMisses);
  }
  SeenThrough through;
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    if (grid.at(n) == Cell::free || seen.grid().at(n) != Cell::free) continue;
    ++(grid.at(n) == Cell::unknown ? through.unknown : through.occupied);
    grid.set(grid.voxel(n), Cell::free);
  }
  return through;
}

}  // namespace backwash::map
