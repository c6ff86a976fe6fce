// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/map/map_change.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/daemon/map/map_worker_rig.hpp"

namespace backwash::daemon {
namespace {

using map::Cell;
using map::OccupancyGrid;

OccupancyGrid drawn(std::mt19937_64& random, const Vec3& origin, double resolution, const Index3& size, int blocks) {
  OccupancyGrid grid(origin, resolution, size, Cell::free);
  for (int n = 0; n < blocks; ++n) {
    const Index3 low = grid.voxel(random() % grid.cell_count());
    const auto cell = random() % 2 ? Cell::occupied : Cell::unknown;
    map::for_each_voxel(map::common({low, low + Index3(random() % 6, random() % 6, random() % 6)}, map::all_of(size)),
                        [&](const Index3& v) { grid.set(v, cell); });
  }
  return grid;
}

TEST(News, AreWhatWasFreeAndIsNotAnyMoreWhateverExtentOriginAndResolutionTheNewMapHas) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> in(-0.5, 5.5);
  std::size_t new_ones = 0, clear = 0;
  for (int round = 0; round < 60; ++round) {
    const OccupancyGrid before = drawn(random, {0, 0, 0}, 0.1, {50, 40, 20}, 30);
    const bool lattice = round % 2;
    const Vec3 origin = 0.1 * Vec3(static_cast<int>(random() % 9) - 4, static_cast<int>(random() % 9) - 4, 0);
    const OccupancyGrid after = drawn(random, lattice ? origin : Vec3(origin + Vec3(0.03, 0.05, 0.01)),
                                      round % 3 ? 0.1 : 0.2, {48, 44, 18}, 25);
    const NewVoxels news = daemon::news(before, after, 7);
    ASSERT_GT(news.count, 0u);
    EXPECT_EQ(news.received_ns, 7);
    for (int n = 0; n < 3000; ++n) {
      const Vec3 p(in(random), in(random), in(random) / 2.5);
      const bool gone = before.free(before.index(p)) && !after.free(after.index(p));
      ASSERT_TRUE(holds(news, p) || !gone) << "round " << round << " at " << p.transpose();
      new_ones += gone;
      if (lattice && round % 3 && news.edge < 0.15 && after.free(after.index(p))) {
        ASSERT_FALSE(holds(news, p)) << "it is free: round " << round << " at " << p.transpose();
        ++clear;
      }
    }
  }
  EXPECT_GT(new_ones, 10'000u);
  EXPECT_GT(clear, 5'000u);
}

// 256 records are few for a room. It is told as it is all the same: what a flight is clear of stays clear.
TEST(News, OfWallsRoomsAndOfWhatIsOutsideAreToldToAVoxel) {
  OccupancyGrid before({0, 0, 0}, 0.1, {120, 80, 30}, Cell::free);
  for (int n = 0; n < 200; ++n) before.set({n % 50 + 3, n / 50 * 9 + 4, n % 28}, Cell::occupied);  // furniture
  OccupancyGrid after = before;
  const map::VoxelBox room{{10, 10, 0}, {49, 59, 29}}, wall{{70, 5, 0}, {70, 75, 29}};
  map::for_each_voxel(room, [&](const Index3& v) { after.set(v, Cell::unknown); });
  map::for_each_voxel(wall, [&](const Index3& v) { after.set(v, Cell::occupied); });
  const map::VoxelBox kept{{0, 0, 0}, {99, 79, 29}};
  const NewVoxels news = daemon::news(before, map::part_of(after, kept), 1);
  EXPECT_DOUBLE_EQ(news.edge, 0.1);
  map::for_each_voxel(map::all_of(before.size()), [&](const Index3& v) {
    const bool gone = room.contains(v) || wall.contains(v) || !kept.contains(v);
    if (before.free(v)) {
      ASSERT_EQ(holds(news, before.center(v)), gone) << v.transpose();
    }
  });
}

TEST(News, OfMoreThanABoxEachAreToldInLargerCubes) {
  std::mt19937_64 random(5);
  const OccupancyGrid before({0, 0, 0}, 0.1, {60, 60, 30}, Cell::free);
  OccupancyGrid after = before;
  for (int n = 0; n < 3000; ++n) after.set(after.voxel(random() % after.cell_count()), Cell::occupied);
  const NewVoxels news = daemon::news(before, after, 1);
  EXPECT_GT(news.edge, 0.1);
  for (std::size_t n = 0; n < after.cell_count(); ++n)
    if (!after.free(after.voxel(n))) {
      ASSERT_TRUE(holds(news, after.center(after.voxel(n))));
    }
}

}  // namespace
}  // namespace backwash::daemon
