// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/map_faces.hpp"

#include <gtest/gtest.h>

#include <array>
#include <map>
#include <random>

namespace backwash::report {
namespace {

using Cell = std::array<int, 4>;  // side, plane, and the two others

/// What a face covers, cell by cell, and how often.
std::map<Cell, int> cells_of(const MapFaces& map) {
  std::map<Cell, int> covered;
  for (const auto& f : map.faces)
    for (int u = f.low[0]; u < f.high[0]; ++u)
      for (int v = f.low[1]; v < f.high[1]; ++v) ++covered[{f.side, f.plane, u, v}];
  return covered;
}

TEST(MapFaces, CoverEachBorderOfOccupiedToFreeOnceAndNothingElse) {
  std::mt19937 random(7);
  map::OccupancyGrid grid({-1, 2, 0.5}, 0.25, {9, 7, 6}, map::Cell::free);
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const auto drawn = random() % 3;
    grid.set(grid.voxel(n), drawn == 0 ? map::Cell::occupied : drawn == 1 ? map::Cell::free : map::Cell::unknown);
  }
  std::map<Cell, int> wanted;
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const Index3 v = grid.voxel(n);
    if (!grid.occupied(v)) continue;
    for (int axis = 0; axis < 3; ++axis)
      for (const int step : {-1, 1}) {
        const Index3 beside = v + step * Index3::Unit(axis);
        if (!grid.free(beside)) continue;
        wanted[{2 * axis + (step > 0), v[axis] + (step > 0), v[axis == 0 ? 1 : 0], v[axis == 2 ? 1 : 2]}] = 1;
      }
  }
  const std::vector<Vec3> path = {grid.center({4, 3, 3})};
  EXPECT_EQ(cells_of(map_faces(grid, path)), wanted);
}

TEST(MapFaces, MergeAWallIntoOneRectangleASide) {
  map::OccupancyGrid grid({0, 0, 0}, 0.1, {20, 20, 20}, map::Cell::free);
  for (int i = 2; i < 18; ++i)
    for (int k = 3; k < 15; ++k) grid.set({i, 10, k}, map::Cell::occupied);
  const std::vector<Vec3> path = {{1, 1, 1}};
  const auto map = map_faces(grid, path);
  EXPECT_EQ(map.faces.size(), 6u);
  EXPECT_EQ(map.left_out, 0u);
}

TEST(MapFaces, LeaveOutTheFarthestAndSayHowFarTheyBegin) {
  map::OccupancyGrid grid({0, 0, 0}, 0.1, {100, 3, 3}, map::Cell::free);
  for (int i = 1; i < 100; i += 2) grid.set({i, 1, 1}, map::Cell::occupied);
  const std::vector<Vec3> path = {{0, 0.15, 0.15}};
  const auto all = map_faces(grid, path), few = map_faces(grid, path, 60);
  EXPECT_EQ(few.faces.size(), 60u);
  EXPECT_EQ(few.left_out, all.faces.size() - 60);
  for (const auto& f : few.faces) {
    const double x = f.side < 2 ? f.plane * 0.1 : 0.05 * (f.low[0] + f.high[0]);
    EXPECT_LE(x, few.beyond_m + 1e-9);
  }
  const auto near = map_faces(grid, path, 30000, 2.0);
  for (const auto& f : near.faces) EXPECT_LE(f.side < 2 ? f.plane : f.high[0], 22);
  EXPECT_GT(all.faces.size(), near.faces.size());
}

}  // namespace
}  // namespace backwash::report
