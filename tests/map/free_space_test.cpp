// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/free_space.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
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
  EXPECT_EQ(free_by_rays(grid, points, sensors).unknown, 8u + 7u);
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(grid.at({i, 1, 0}), i == 4 ? Cell::occupied : i < 9 ? Cell::free : Cell::unknown);
    EXPECT_EQ(grid.at({i, 3, 0}), i < 7 ? Cell::free : Cell::unknown);
    EXPECT_EQ(grid.at({i, 2, 0}), Cell::unknown);
  }
}

/// What scans of a room of 6 x 4 x 2.4 m, its walls in the middle of voxels, make of it; somebody of 0.5 m stands or
/// walks in it while `there` says where.
struct Walked {
  OccupancyGrid before, after;
  SeenThrough through;
};
template <class There>
Walked walked(int scans, There there) {
  const Vec3 low(0.05, 0.05, 0.05), high(6.05, 4.05, 2.45);
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> any(-1, 1);
  std::vector<Vec3> points, sensors;
  for (int n = 0; n < scans; ++n) {
    const Vec3 sensor(1.03 + 4.0 * n / scans, 2.02, 1.21);
    const std::optional<Vec3> body = there(n);
    for (int ray = 0; ray < 1500; ++ray) {
      const Vec3 way = Vec3(any(random), any(random), any(random)).normalized();
      double range = 1e9;
      for (int k = 0; k < 3; ++k) range = std::min(range, ((way[k] > 0 ? high[k] : low[k]) - sensor[k]) / way[k]);
      if (body) {  // an upright cylinder, met where the way first enters it
        const double a = way.head<2>().squaredNorm(), b = way.head<2>().dot((sensor - *body).head<2>());
        const double c = (sensor - *body).head<2>().squaredNorm() - 0.25 * 0.25, root = b * b - a * c;
        if (root > 0 && b < 0) range = std::min(range, (-b - std::sqrt(root)) / a);
      }
      points.push_back(sensor + range * way);
      sensors.push_back(sensor);
    }
  }
  Walked all{OccupancyGrid({-0.1, -0.1, -0.1}, 0.1, {63, 43, 27}), OccupancyGrid({0, 0, 0}, 0.1, {1, 1, 1}), {}};
  for (const Vec3& p : points) all.before.set(all.before.index(p), Cell::occupied);
  all.after = all.before;
  all.through = free_by_rays(all.after, points, sensors);
  return all;
}

/// Occupied voxels of the walls, and of what is between them.
std::pair<int, int> walls_and_others(const OccupancyGrid& grid) {
  std::pair<int, int> counts;
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const Vec3 p = grid.center(grid.voxel(n));
    const bool inside = p.x() > 0.1 && p.x() < 6 && p.y() > 0.1 && p.y() < 4 && p.z() > 0.1 && p.z() < 2.4;
    if (grid.occupied(grid.voxel(n))) ++(inside ? counts.second : counts.first);
  }
  return counts;
}

TEST(FreeByRays, WhoWalksOrStandsForThreeSecondsDoesNotStayAndWallsDo) {
  const auto walks = [](int n) { return n < 30 ? std::optional(Vec3(3, 0.5 + 0.1 * n, 0)) : std::nullopt; };
  const auto stands = [](int n) { return n >= 20 && n < 50 ? std::optional(Vec3(4.5, 1.2, 0)) : std::nullopt; };
  for (const auto& all : {walked(120, walks), walked(120, stands)}) {
    const auto [walls, others] = walls_and_others(all.before);
    const auto [still, left] = walls_and_others(all.after);
    EXPECT_GT(others, 100);
    EXPECT_LE(left, others / 50) << "of " << others << " voxels that somebody was in";
    EXPECT_GE(still, walls - walls / 200) << "of " << walls << " voxels of walls";
    EXPECT_EQ(all.through.occupied, static_cast<std::size_t>(walls + others - still - left));
  }
}

TEST(FreeByRays, WhatStandsUntilTheEndStaysButForItsRim) {
  const auto all = walked(60, [](int) { return std::optional(Vec3(3.5, 0.9, 0)); });
  EXPECT_GE(walls_and_others(all.after).second, 0.97 * walls_and_others(all.before).second);
}

}  // namespace
}  // namespace backwash::map
