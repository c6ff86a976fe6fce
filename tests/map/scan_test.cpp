// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/scan/scan.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

namespace backwash::map {
namespace {

constexpr double kFar = 100;

/// Length of the segment inside a voxel's cube (slabs), m; negative if it misses it.
double length_inside(const OccupancyGrid& grid, const Index3& v, const Vec3& from, const Vec3& to) {
  double enter = 0, leave = 1;
  for (int i = 0; i < 3; ++i) {
    const double low = grid.center(v)[i] - grid.resolution() / 2, high = low + grid.resolution();
    const double d = to[i] - from[i];
    if (std::abs(d) < 1e-15) {
      if (from[i] < low || from[i] > high) return -1;
      continue;
    }
    enter = std::max(enter, std::min((low - from[i]) / d, (high - from[i]) / d));
    leave = std::min(leave, std::max((low - from[i]) / d, (high - from[i]) / d));
  }
  return (leave - enter) * (to - from).norm();
}

Vec3 inside(const OccupancyGrid& grid, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const Vec3 share(unit(random), unit(random), unit(random));
  return grid.origin() + grid.resolution() * share.cwiseProduct(grid.size().cast<double>());
}

TEST(LiveMap, FreesExactlyTheVoxelsThatTheRayCrosses) {
  std::mt19937_64 random(1);
  for (int round = 0; round < 200; ++round) {
    LiveMap map(OccupancyGrid({-1.3, 0.4, -0.2}, 0.1, {20, 17, 13}));
    const Vec3 sensor = inside(map.grid(), random), point = inside(map.grid(), random);
    map.insert(std::vector{point}, sensor, kFar);
    const Index3 end = map.grid().index(point);
    for (std::size_t n = 0; n < map.grid().cell_count(); ++n) {
      const Index3 v = map.grid().voxel(n);
      const double length = length_inside(map.grid(), v, sensor, point);
      const Cell cell = map.grid().at(n);
      if (v == end) {
        EXPECT_EQ(cell, Cell::occupied);
      } else if (length > 1e-9) {
        EXPECT_EQ(cell, Cell::free) << "round " << round << ", crossed over " << length << " m";
      } else if (length < -1e-9) {
        EXPECT_EQ(cell, Cell::unknown) << "round " << round << ", missed by " << -length << " m";
      }
    }
  }
}

TEST(LiveMap, OccupiedWinsWithinOneScanWhateverTheOrderOfThePoints) {
  // The second point lies behind the first in the same row.
  std::vector<Vec3> points{{0.55, 0.05, 0.05}, {0.95, 0.05, 0.05}};
  for (int order = 0; order < 2; ++order) {
    LiveMap map(OccupancyGrid({0, 0, 0}, 0.1, {10, 1, 1}));
    map.insert(points, {0.05, 0.05, 0.05}, kFar);
    EXPECT_TRUE(map.grid().occupied({5, 0, 0}));
    EXPECT_TRUE(map.grid().occupied({9, 0, 0}));
    EXPECT_TRUE(map.grid().free({7, 0, 0}));
    std::swap(points[0], points[1]);
  }
}

TEST(LiveMap, AnOccupiedVoxelIsFreeOnlyAfterFiveMissesInARow) {
  LiveMap map(OccupancyGrid({0, 0, 0}, 0.1, {10, 1, 1}, Cell::occupied));
  const Vec3 sensor(0.05, 0.05, 0.05);
  const std::vector<Vec3> behind{{0.95, 0.05, 0.05}}, on_it{{0.55, 0.05, 0.05}};
  const auto miss = [&](int times) {
    for (; times > 0; --times) map.insert(behind, sensor, kFar);
  };
  miss(4);
  EXPECT_TRUE(map.grid().occupied({5, 0, 0}));
  map.insert(on_it, sensor, kFar);  // starts the count anew
  miss(4);
  EXPECT_TRUE(map.grid().occupied({5, 0, 0}));
  miss(1);
  EXPECT_TRUE(map.grid().free({5, 0, 0}));
}

TEST(LiveMap, PointsBeyondTheRangeFreeTheWayAndOccupyNothing) {
  LiveMap map(OccupancyGrid({0, 0, 0}, 0.1, {10, 1, 1}));
  const auto change = map.insert(std::vector<Vec3>{{0.95, 0.05, 0.05}}, {0.05, 0.05, 0.05}, 0.5);
  EXPECT_TRUE(change.occupied.empty());
  EXPECT_TRUE(map.grid().free({4, 0, 0}));
  EXPECT_EQ(map.grid().at(Index3(6, 0, 0)), Cell::unknown);
}

TEST(LiveMap, PointsThatAreNotFiniteOrOutsideTheGridDoNoHarm) {
  LiveMap map(OccupancyGrid({0, 0, 0}, 0.1, {10, 3, 3}));
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  const std::vector<Vec3> points{{nan, 0, 0}, {0.5, inf, 0}, {0.55, -3, 0.15}, {1e300, 0, 0}, {0.15, 0.15, 0.15}};
  const auto change = map.insert(points, {0.15, 0.15, 0.15}, 20);
  for (const Index3& v : change.occupied) EXPECT_EQ(v, Index3(1, 1, 1));
}

TEST(LiveMap, TheChangeNamesEveryVoxelThatDiffers) {
  std::mt19937_64 random(2);
  LiveMap map(OccupancyGrid({0, 0, 0}, 0.1, {15, 15, 10}));
  for (int scan = 0; scan < 40; ++scan) {
    const OccupancyGrid before = map.grid();
    std::vector<Vec3> points;
    for (int n = 0; n < 30; ++n) points.push_back(inside(before, random));
    const auto change = map.insert(points, inside(before, random), 1.2);
    VoxelBox box;
    std::set<std::size_t> occupied;
    for (std::size_t n = 0; n < before.cell_count(); ++n) {
      if (map.grid().at(n) == before.at(n)) continue;
      box.add(before.voxel(n));
      if (map.grid().at(n) == Cell::occupied) occupied.insert(n);
    }
    std::set<std::size_t> named;
    for (const Index3& v : change.occupied) named.insert(before.linear(v));
    EXPECT_EQ(named, occupied);
    EXPECT_EQ(change.box.low, box.low);
    EXPECT_EQ(change.box.high, box.high);
  }
}

}  // namespace
}  // namespace backwash::map
