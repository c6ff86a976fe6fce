// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/search/components.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <vector>

namespace backwash::plan {
namespace {

using map::Cell;
using map::OccupancyGrid;

/// Numbers from a flood over shared faces, 0 where a voxel is not free.
std::vector<int> flooded(const OccupancyGrid& grid) {
  std::vector<int> number(grid.cell_count(), 0);
  int last = 0;
  for (std::size_t seed = 0; seed < grid.cell_count(); ++seed) {
    if (number[seed] || grid.at(seed) != Cell::free) continue;
    std::vector<Index3> front{grid.voxel(seed)};
    number[seed] = ++last;
    while (!front.empty()) {
      const Index3 v = front.back();
      front.pop_back();
      for (const Index3& step :
           {Index3(1, 0, 0), Index3(-1, 0, 0), Index3(0, 1, 0), Index3(0, -1, 0), Index3(0, 0, 1), Index3(0, 0, -1)}) {
        const Index3 u = v + step;
        if (!grid.free(u) || number[grid.linear(u)]) continue;
        number[grid.linear(u)] = last;
        front.push_back(u);
      }
    }
  }
  return number;
}

/// Both number the same partition of the free voxels.
void expect_same(const Components& components, const OccupancyGrid& grid) {
  const std::vector<int> number = flooded(grid);
  std::map<int, std::uint32_t> there;
  std::map<std::uint32_t, int> back;
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const std::uint32_t component = components.of(grid.voxel(n));
    ASSERT_EQ(component == Components::kNone, number[n] == 0);
    ASSERT_EQ(components.free(grid.voxel(n)), number[n] != 0);
    if (!number[n]) continue;
    ASSERT_EQ(there.emplace(number[n], component).first->second, component) << grid.voxel(n).transpose();
    ASSERT_EQ(back.emplace(component, number[n]).first->second, number[n]) << grid.voxel(n).transpose();
  }
}

/// Walls with few holes: components that wind through many tiles, are joined by one voxel and parted by another.
OccupancyGrid maze(std::mt19937& random, const Index3& size) {
  OccupancyGrid grid({0, 0, 0}, 0.1, size, Cell::free);
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const Index3 v = grid.voxel(n);
    const bool wall = v.x() % 7 == 3 || v.y() % 9 == 4 || v.z() % 11 == 5;
    if (wall && random() % 60) grid.set(v, random() % 2 ? Cell::occupied : Cell::unknown);
  }
  return grid;
}

TEST(Components, AreThoseOfAFlood) {
  std::mt19937 random(1);
  for (const Index3& size : {Index3(40, 35, 33), Index3(16, 16, 16), Index3(17, 3, 50), Index3(1, 1, 1)})
    for (int trial = 0; trial < 4; ++trial) {
      const OccupancyGrid grid = maze(random, size);
      expect_same(Components(grid), grid);
    }
}

TEST(Components, FollowWhatJoinsAndPartsThemAndLeaveCopiesAsTheyWere) {
  std::mt19937 random(2);
  OccupancyGrid grid = maze(random, {45, 40, 36});
  Components components(grid);
  for (int round = 0; round < 120; ++round) {
    const OccupancyGrid before = grid;
    const Components old = components;
    map::VoxelBox changed;
    const int apart = round % 2 ? 45 : 3;  // a change far and wide, or in a tile or two
    const Index3 low = grid.voxel(random() % grid.cell_count());
    const auto draw = [&] { return static_cast<int>(random() % static_cast<unsigned>(apart)); };
    for (int n = 0; n < 4; ++n) {
      const Index3 v = (low + Index3(draw(), draw(), draw())).cwiseMin(grid.size() - Index3::Ones());
      grid.set(v, grid.free(v) ? Cell::occupied : Cell::free);
      changed.add(v);
    }
    components.update(grid, changed);
    expect_same(components, grid);
    expect_same(old, before);
  }
}

}  // namespace
}  // namespace backwash::plan
