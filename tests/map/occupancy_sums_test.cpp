// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/occupancy_sums.hpp"

#include <gtest/gtest.h>

#include <random>

#include "core/map/load_map.hpp"
#include "tests/map/random_grid.hpp"

namespace backwash::map {
namespace {

bool brute_force(const OccupancyGrid& grid, const Index3& low, const Index3& high) {
  for (int k = low.z(); k <= high.z(); ++k) {
    for (int j = low.y(); j <= high.y(); ++j) {
      for (int i = low.x(); i <= high.x(); ++i) {
        if (!grid.free({i, j, k})) return false;
      }
    }
  }
  return true;
}

/// Every voxel, and one layer outside, whose closed cube meets the closed box.
bool brute_force_box(const OccupancyGrid& grid, const Vec3& low_W, const Vec3& high_W) {
  const double a = grid.resolution();
  const Vec3 end = grid.origin() + a * grid.size().cast<double>();
  if ((low_W.array() <= grid.origin().array()).any() || (high_W.array() >= end.array()).any()) return false;
  for (int k = -1; k <= grid.size().z(); ++k) {
    for (int j = -1; j <= grid.size().y(); ++j) {
      for (int i = -1; i <= grid.size().x(); ++i) {
        const Vec3 corner = grid.origin() + a * Vec3(i, j, k);
        const bool meets = (corner.array() <= high_W.array()).all() && (corner.array() + a >= low_W.array()).all();
        if (meets && !grid.free({i, j, k})) return false;
      }
    }
  }
  return true;
}

Index3 random_index(std::mt19937_64& random, const Index3& size, int beyond) {
  Index3 v;
  for (int axis = 0; axis < 3; ++axis) {
    v[axis] = static_cast<int>(random() % static_cast<std::uint64_t>(size[axis] + 2 * beyond)) - beyond;
  }
  return v;
}

TEST(OccupancySums, EqualBruteForceOnRandomGridsAndOutsideThem) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> u(-0.2, 1.2), extent(0, 0.4);
  int free = 0, blocked = 0, free_boxes = 0;
  for (int trial = 0; trial < 600; ++trial) {
    const OccupancyGrid grid = random_grid(random, 14);
    const OccupancySums sums(grid);
    for (int query = 0; query < 100; ++query) {
      const Index3 low = random_index(random, grid.size(), 2);
      const Index3 high =
          low + Index3(static_cast<int>(random() % 4), static_cast<int>(random() % 4), static_cast<int>(random() % 4));
      const bool expected = brute_force(grid, low, high);
      ASSERT_EQ(sums.voxels_free(low, high), expected);
      (expected ? free : blocked) += 1;
      const Vec3 edges = grid.resolution() * grid.size().cast<double>();
      const Vec3 p = grid.origin() + edges.cwiseProduct(Vec3(u(random), u(random), u(random)));
      const Vec3 q = p + Vec3(extent(random), extent(random), extent(random));
      ASSERT_EQ(sums.box_free(p, q), brute_force_box(grid, p, q));
      free_boxes += sums.box_free(p, q);
    }
  }
  EXPECT_GT(free, 1000);
  EXPECT_GT(blocked, 1000);
  EXPECT_GT(free_boxes, 1000);
}

TEST(OccupancySums, CountATouchedFaceAndRefuseWhatIsNoBox) {
  OccupancyGrid grid(Vec3::Zero(), 0.25, Index3(8, 8, 8), Cell::free);
  grid.set({4, 4, 4}, Cell::unknown);
  const OccupancySums sums(grid);
  EXPECT_FALSE(sums.box_free(Vec3(0.5, 1.1, 1.1), Vec3(1.0, 1.2, 1.2)));  // ends on its face
  EXPECT_TRUE(sums.box_free(Vec3(0.5, 1.1, 1.1), Vec3(0.999, 1.2, 1.2)));
  EXPECT_FALSE(sums.box_free(Vec3(1.25, 1.1, 1.1), Vec3(1.5, 1.2, 1.2)));  // begins on its face
  EXPECT_TRUE(sums.box_free(Vec3(1.251, 1.1, 1.1), Vec3(1.5, 1.2, 1.2)));
  EXPECT_FALSE(sums.box_free(Vec3(0, 0.1, 0.1), Vec3(0.1, 0.2, 0.2)));  // the grid's own side is a face of the unknown
  EXPECT_FALSE(sums.box_free(Vec3(1.5, 1.5, 1.5), Vec3(1e300, 1.6, 1.6)));
  EXPECT_FALSE(sums.box_free(Vec3::Constant(std::nan("")), Vec3(1, 1, 1)));
}

TEST(OccupancySums, FollowChangesOfTheMap) {
  std::mt19937_64 random(2);
  for (int trial = 0; trial < 200; ++trial) {
    OccupancyGrid grid = random_grid(random, 12);
    OccupancySums sums(grid);
    for (int change = 0; change < 4; ++change) {
      Index3 low = grid.size(), high = -Index3::Ones();
      for (int n = 0; n < 5; ++n) {
        const Index3 v = random_index(random, grid.size(), 0);
        grid.set(v, static_cast<Cell>(random() % 3));
        low = low.cwiseMin(v);
        high = high.cwiseMax(v);
      }
      sums.update(grid, low, high);
      for (int query = 0; query < 100; ++query) {
        const Index3 a = random_index(random, grid.size(), 1), b = random_index(random, grid.size(), 1);
        ASSERT_EQ(sums.voxels_free(a.cwiseMin(b), a.cwiseMax(b)), brute_force(grid, a.cwiseMin(b), a.cwiseMax(b)));
      }
    }
  }
}

// Sums are kept modulo 2¹⁶: a box with exactly that many obstacles must not look free.
TEST(OccupancySums, HoldForBoxesOfMoreVoxelsThanTheyCanCount) {
  OccupancyGrid grid(Vec3::Zero(), 0.1, Index3(64, 64, 32), Cell::occupied);
  for (int i = 0; i < 64; ++i) {
    for (int j = 0; j < 64; ++j) {
      for (int k = 0; k < 16; ++k) grid.set({i, j, k}, Cell::free);
    }
  }
  const Index3 end(63, 63, 31);
  EXPECT_FALSE(OccupancySums(grid).voxels_free(Index3::Zero(), end));  // 2¹⁶ of 2¹⁷
  EXPECT_FALSE(OccupancySums(grid).voxels_free(Index3(0, 0, 16), end));
  for (std::size_t n = 0; n < grid.cell_count(); ++n) grid.set(grid.voxel(n), Cell::free);
  OccupancySums sums(grid);
  EXPECT_TRUE(sums.voxels_free(Index3::Zero(), end));
  grid.set({40, 50, 30}, Cell::unknown);
  sums.update(grid, {40, 50, 30}, {40, 50, 30});
  EXPECT_FALSE(sums.voxels_free(Index3::Zero(), end));
}

TEST(OccupancySums, EqualBruteForceOnTheRealMap) {
  const std::string path = BACKWASH_SOURCE_DIR "/tests/data/maps/geb079.bt";
  const auto grid = load_map(path);
  ASSERT_TRUE(grid);
  const OccupancySums sums(*grid);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> u(0, 1), extent(0, 0.6);
  std::vector<std::pair<Vec3, Vec3>> boxes;
  for (int n = 0; n < 4000; ++n) {
    const Vec3 edges = grid->resolution() * grid->size().cast<double>();
    const Vec3 p = grid->origin() + edges.cwiseProduct(Vec3(u(random), u(random), u(random)));
    boxes.push_back({p, p + Vec3(extent(random), extent(random), extent(random))});
  }
  int free = 0;
  for (const auto& [low, high] : boxes) {
    const Index3 from = ((low - grid->origin()) / grid->resolution()).array().ceil().cast<int>() - 1;
    const Index3 to = ((high - grid->origin()) / grid->resolution()).array().floor().cast<int>();
    ASSERT_EQ(sums.box_free(low, high), brute_force(*grid, from, to));
    free += sums.box_free(low, high);
  }
  EXPECT_GT(free, 100);
  EXPECT_LT(free, 3900);
}

}  // namespace
}  // namespace backwash::map
