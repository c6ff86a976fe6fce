// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/free_space.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace backwash::map {
namespace {

/// A closed box of 20 × 15 × 10 voxels of air within walls of one voxel, in a grid that is one voxel wider all around.
OccupancyGrid room() {
  OccupancyGrid grid({0, 0, 0}, 0.1, {24, 19, 14});
  for (std::size_t i = 0; i < grid.cell_count(); ++i) {
    const Index3 v = grid.voxel(i), from_high = grid.size() - Index3::Ones() - v;
    if (v.minCoeff() >= 1 && from_high.minCoeff() >= 1 && (v.minCoeff() == 1 || from_high.minCoeff() == 1))
      grid.set(v, Cell::occupied);
  }
  return grid;
}

TEST(FloodFree, FreesTheVolumeOfAClosedRoomAndNothingElse) {
  auto grid = room();
  const auto flood = flood_free(grid, std::array{Index3(10, 9, 5)});
  EXPECT_EQ(flood.freed, 20u * 15u * 10u);
  EXPECT_EQ(std::ranges::count(grid.cells(), Cell::free), 20 * 15 * 10);
  EXPECT_TRUE(std::ranges::none_of(flood.edge, [](const auto& edge) { return edge.has_value(); }));
  EXPECT_EQ(flood_free(grid, std::array{Index3(10, 9, 5)}).freed, 0u);
}

TEST(FloodFree, TellsWhereItLeavesThroughAHole) {
  auto grid = room();
  grid.set({1, 9, 5}, Cell::unknown);
  const auto flood = flood_free(grid, std::array{Index3(10, 9, 5)});
  ASSERT_TRUE(flood.edge[0]);
  EXPECT_EQ(*flood.edge[0], Index3(0, 9, 5));
  EXPECT_EQ(std::ranges::count(grid.cells(), Cell::unknown), 0);
}

TEST(FloodFree, FreesWhatNeighboursSpreadInARandomGrid) {
  std::mt19937_64 random(7);
  for (int round = 0; round < 20; ++round) {
    OccupancyGrid grid({0, 0, 0}, 0.1, {9, 8, 7});
    for (std::size_t i = 0; i < grid.cell_count(); ++i)
      if (random() % 5 < 2) grid.set(grid.voxel(i), random() % 4 ? Cell::occupied : Cell::free);
    const Index3 seed = grid.voxel(random() % grid.cell_count());
    if (grid.occupied(seed)) continue;
    std::vector<char> joined(grid.cell_count());
    joined[grid.linear(seed)] = 1;
    for (bool more = true; more;) {  // until nothing changes any more
      more = false;
      for (std::size_t i = 0; i < grid.cell_count(); ++i) {
        if (joined[i] || grid.at(i) == Cell::occupied) continue;
        for (std::size_t j = 0; j < grid.cell_count() && !joined[i]; ++j)
          if (joined[j] && (grid.voxel(i) - grid.voxel(j)).cwiseAbs().sum() == 1) joined[i] = more = true;
      }
    }
    auto flooded = grid;
    flood_free(flooded, std::array{seed});
    for (std::size_t i = 0; i < grid.cell_count(); ++i)
      ASSERT_EQ(flooded.at(i), joined[i] ? Cell::free : grid.at(i)) << round;
  }
}

TEST(FreeByRays, FreesWhatRaysPassAndLeavesWhatIsOccupiedOrUnseen) {
  OccupancyGrid grid({0, 0, 0}, 0.1, {10, 5, 1});
  grid.set({4, 1, 0}, Cell::occupied);  // by another scan
  const std::vector<Vec3> points = {{0.95, 0.15, 0.05}, {0.75, 0.35, 0.05}};
  const std::vector<Vec3> sensors = {{0.05, 0.15, 0.05}, {0.05, 0.35, 0.05}};
  EXPECT_EQ(free_by_rays(grid, points, sensors), 8u + 7u);
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(grid.at({i, 1, 0}), i == 4 ? Cell::occupied : i < 9 ? Cell::free : Cell::unknown);
    EXPECT_EQ(grid.at({i, 3, 0}), i < 7 ? Cell::free : Cell::unknown);
    EXPECT_EQ(grid.at({i, 2, 0}), Cell::unknown);
  }
}

}  // namespace
}  // namespace backwash::map
