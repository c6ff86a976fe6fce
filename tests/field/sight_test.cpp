// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "core/field/sight/sight.hpp"
#include "tests/field/brute_force.hpp"
#include "tests/field/scenes.hpp"
#include "tests/support/line_of_sight.hpp"

namespace backwash::field {
namespace {

using map::Cell;
using map::OccupancyGrid;

bool seen(const SightMap& sight, const Vec3& p, const Vec3& c) { return sight.line_of_sight(sight.viewpoint(p), c); }

/// 6³ voxels of 1 m; segments are given whole, the 2 m that are left out are added here.
struct Lab {
  OccupancyGrid grid{Vec3::Zero(), 1, Index3(6, 6, 6), Cell::free};
  void block(int i, int j, int k) { grid.set(Index3(i, j, k), Cell::occupied); }
  bool clear(const Vec3& from, const Vec3& to) const {
    const Vec3 c = to + 2 * (to - from).normalized();
    const bool plain = line_of_sight(grid, from, c);
    EXPECT_EQ(seen(SightMap(grid), from, c), plain);
    return plain;
  }
};

TEST(LineOfSight, EqualsTheClosedBoxTestOfEveryVoxelOnRandomSegments) {
  std::mt19937 random(7);
  int blocked = 0, total = 0;
  for (unsigned seed = 0; seed < 8; ++seed) {
    const double a = 0.1 + 0.05 * seed;
    const OccupancyGrid grid = scene::random_map(seed, a);
    const SightMap sight(grid);
    const auto occupied = oracle::occupied_centers(grid);
    // Ends anywhere, a little outside the grid as well; every second pair on the lattice of half voxels, where segments
    // run through edges, corners and inside faces.
    std::uniform_real_distribution<double> u(-3, 21);
    std::uniform_int_distribution<int> lattice(-4, 40);
    for (int n = 0; n < 2500; ++n, ++total) {
      const auto point = [&]() -> Vec3 {
        if (n % 2) return grid.origin() + a * Vec3(u(random), u(random), u(random));
        return grid.origin() + a * 0.5 * Vec3(lattice(random), lattice(random), lattice(random));
      };
      const Vec3 p = point(), c = point();
      const bool expected = oracle::sees(occupied, a, p, c);
      ASSERT_EQ(line_of_sight(grid, p, c), expected) << "seed " << seed << " n " << n;
      ASSERT_EQ(seen(sight, p, c), expected) << "seed " << seed << " n " << n;
      blocked += !expected;
    }
  }
  EXPECT_GT(blocked, total / 4);
  EXPECT_LT(blocked, total * 9 / 10);
}

TEST(LineOfSight, DoesNotLeakBetweenTwoVoxelsThatTouchAtAnEdge) {
  Lab lab;
  lab.block(2, 3, 2);
  lab.block(3, 2, 2);
  EXPECT_FALSE(lab.clear({1.5, 1.5, 2.5}, {4.5, 4.5, 2.5}));
  EXPECT_FALSE(lab.clear({1.5, 1.5, 2.1}, {4.5, 4.5, 2.9}));
  EXPECT_TRUE(lab.clear({1.5, 1.5, 3.5}, {4.5, 4.5, 3.5}));
}

TEST(LineOfSight, IsBlockedByAnyVoxelThatTouchesTheEdgeOrCornerItPasses) {
  for (int n = 0; n < 8; ++n) {
    Lab lab;
    lab.block(2 + (n & 1), 2 + (n >> 1 & 1), 2 + (n >> 2));  // the eight voxels around the corner (3, 3, 3)
    for (const Vec3& d : {Vec3(1, 1, 1), Vec3(1, -1, 1), Vec3(-1, 1, 1), Vec3(1, 1, -1), Vec3(1, 0.25, -0.5)})
      EXPECT_FALSE(lab.clear(Vec3(3, 3, 3) - 1.5 * d, Vec3(3, 3, 3) + 1.5 * d)) << n << " along " << d.transpose();
  }
  Lab edge;
  edge.block(2, 2, 2);
  EXPECT_FALSE(edge.clear({3, 3, 0.5}, {3, 3, 4.5}));        // along an edge
  EXPECT_FALSE(edge.clear({3, 2.5, 0.5}, {3, 2.5, 4.5}));    // inside a face
  EXPECT_FALSE(edge.clear({3.5, 2.5, 2.5}, {3, 2.5, 2.5}));  // ends on a face
  EXPECT_FALSE(edge.clear({3, 2.5, 2.5}, {3.5, 2.5, 2.5}));  // starts on a face
  EXPECT_TRUE(edge.clear({3.001, 2.5, 0.5}, {3.001, 2.5, 4.5}));
  EXPECT_TRUE(edge.clear({3.001, 3.001, 0.5}, {3.001, 3.001, 4.5}));
}

TEST(LineOfSight, LeavesTheLastTwoEdgesOut) {
  Lab lab;
  lab.block(4, 2, 2);
  EXPECT_TRUE(line_of_sight(lab.grid, Vec3(0.5, 2.5, 2.5), Vec3(5.99, 2.5, 2.5)));   // seen part ends at 3.99
  EXPECT_FALSE(line_of_sight(lab.grid, Vec3(0.5, 2.5, 2.5), Vec3(6.01, 2.5, 2.5)));  // at 4.01
  EXPECT_TRUE(line_of_sight(lab.grid, Vec3(4.5, 2.5, 2.5), Vec3(5.5, 3.5, 3.5)));    // nothing but the end
  EXPECT_TRUE(line_of_sight(lab.grid, Vec3(4.5, 2.5, 2.5), Vec3(4.5, 2.5, 2.5)));
}

TEST(LineOfSight, IsNotBlockedByUnknownOrOutside) {
  OccupancyGrid grid(Vec3::Zero(), 1, Index3(6, 6, 6), Cell::unknown);
  EXPECT_TRUE(line_of_sight(grid, Vec3(0.5, 0.5, 0.5), Vec3(5.5, 5.5, 5.5)));
  EXPECT_TRUE(line_of_sight(grid, Vec3(-50, 0.5, 0.5), Vec3(50, 5.5, 5.5)));
  grid.set(Index3(5, 5, 5), Cell::occupied);
  EXPECT_FALSE(line_of_sight(grid, Vec3(20, 5.5, 5.5), Vec3(-20, 5.5, 5.5)));
}

}  // namespace
}  // namespace backwash::field
