// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/distance_field.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/map/random_grid.hpp"

namespace backwash::map {
namespace {

/// Distance from p to the nearest obstacle by looking at every one: all voxels of the grid that are not free, and the
/// outside, whose nearest point lies on one of the grid's six sides.
double brute_force(const OccupancyGrid& grid, const Vec3& p) {
  const Vec3 low = grid.origin();
  const Vec3 high = low + grid.resolution() * grid.size().cast<double>();
  double best = std::max(0.0, std::min((p - low).minCoeff(), (high - p).minCoeff()));
  for (std::size_t i = 0; i < grid.cell_count(); ++i) {
    if (grid.at(i) == Cell::free) continue;
    const Vec3 off = (p - grid.center(grid.voxel(i))).cwiseAbs() - Vec3::Constant(grid.resolution() / 2);
    best = std::min(best, off.cwiseMax(0.0).norm());
  }
  return best;
}

TEST(DistanceField, EqualsBruteForceOnRandomGrids) {
  std::mt19937_64 random(1);
  for (int round = 0; round < 60; ++round) {
    const auto grid = random_grid(random, 14);
    const DistanceField field(grid);
    for (std::size_t i = 0; i < grid.cell_count(); ++i) {
      const Index3 v = grid.voxel(i);
      ASSERT_NEAR(field.at(v), brute_force(grid, grid.center(v)), 1e-6) << "round " << round << " voxel " << v;
    }
  }
}

TEST(DistanceField, ExactEqualsBruteForceAtRandomPoints) {
  std::mt19937_64 random(2);
  for (int round = 0; round < 60; ++round) {
    const auto grid = random_grid(random, 14);
    const DistanceField field(grid);
    std::uniform_real_distribution<double> unit(-0.1, 1.1);
    for (int i = 0; i < 200; ++i) {
      const Vec3 extent = grid.resolution() * grid.size().cast<double>();
      const Vec3 p = grid.origin() + extent.cwiseProduct(Vec3(unit(random), unit(random), unit(random)));
      ASSERT_NEAR(field.exact(grid, p), brute_force(grid, p), 1e-9) << "round " << round << " at " << p.transpose();
    }
  }
}

TEST(DistanceField, ExactIsZeroOnFacesAndAtTheSidesOfTheGrid) {
  OccupancyGrid grid({0, 0, 0}, 0.5, {4, 4, 4}, Cell::free);
  grid.set({2, 2, 2}, Cell::unknown);
  const DistanceField field(grid);
  EXPECT_EQ(field.exact(grid, {1.0, 1.25, 1.25}), 0.0);
  EXPECT_EQ(field.exact(grid, {1.5, 1.25, 1.25}), 0.0);
  EXPECT_EQ(field.exact(grid, {0.0, 0.75, 0.75}), 0.0);
  EXPECT_EQ(field.exact(grid, {2.0, 0.75, 0.75}), 0.0);
  EXPECT_EQ(field.exact(grid, {0.5, 0.75, 9.0}), 0.0);
}

TEST(DistanceField, EqualsBruteForceFarFromSparseObstacles) {
  std::mt19937_64 random(4);
  for (const Index3& size : {Index3(45, 50, 55), Index3(120, 40, 30), Index3(30, 120, 40), Index3(40, 30, 120)}) {
    OccupancyGrid grid({-1, 2, -3}, 0.1, size, Cell::free);
    for (int i = 0; i < 12; ++i) grid.set(grid.voxel(random() % grid.cell_count()), Cell::occupied);
    const DistanceField field(grid);
    for (int i = 0; i < 200; ++i) {
      const Index3 v = grid.voxel(random() % grid.cell_count());
      ASSERT_NEAR(field.at(v), brute_force(grid, grid.center(v)), 1e-6) << v.transpose();
      const Vec3 p = grid.center(v) + Vec3(0.037, -0.021, 0.049);
      ASSERT_NEAR(field.exact(grid, p), brute_force(grid, p), 1e-9) << p.transpose();
    }
  }
}

TEST(DistanceField, MeasuresToTheSidesOfAnEmptyGrid) {
  for (int axis = 0; axis < 3; ++axis) {
    const Index3 line = Index3::Ones() + 3000 * Index3::Unit(axis);
    EXPECT_NEAR(DistanceField(OccupancyGrid({0, 0, 0}, 0.1, line, Cell::free)).at(1500 * Index3::Unit(axis)), 0.05,
                1e-8);
    const Index3 slab = Index3::Constant(70) - 29 * Index3::Unit(axis);  // 41 voxels along one axis
    const DistanceField field(OccupancyGrid({0, 0, 0}, 0.1, slab, Cell::free));
    EXPECT_NEAR(field.at(slab / 2), 2.05, 1e-6);
  }
}

void expect_equal(const DistanceField& a, const DistanceField& b, const OccupancyGrid& grid) {
  for (std::size_t n = 0; n < grid.cell_count(); ++n)
    ASSERT_EQ(a.at(grid.voxel(n)), b.at(grid.voxel(n))) << "voxel " << n;
}

TEST(DistanceField, FollowsChangesBitForBitAndLeavesSnapshotsAsTheyWere) {
  std::mt19937_64 random(6);
  for (const Index3& size : {Index3(40, 35, 30), Index3(90, 20, 40), Index3(9, 80, 33), Index3(70, 65, 4)}) {
    OccupancyGrid grid({-1, 2, -3}, 0.1, size, Cell::free);
    for (int i = 0; i < 8; ++i) grid.set(grid.voxel(random() % grid.cell_count()), Cell::occupied);
    DistanceField field(grid);
    for (int round = 0; round < 40; ++round) {
      const Index3 low = grid.voxel(random() % grid.cell_count());
      const DistanceField snapshot = field;
      const OccupancyGrid before = grid;
      VoxelBox changed;
      for (int n = 0; n < 60; ++n) {
        const Index3 v = (low + Index3(n % 5, n / 5 % 4, n / 20)).cwiseMin(size - Index3::Ones());
        grid.set(v, round % 3 ? Cell::free : static_cast<Cell>(random() % 3));  // what came goes
        changed.add(v);
      }
      field.update(grid, changed);
      expect_equal(field, DistanceField(grid), grid);
      if (round % 8 == 0) expect_equal(snapshot, DistanceField(before), before);
    }
    field.update(grid, VoxelBox{});
    expect_equal(field, DistanceField(grid), grid);
  }
}

// Squares of 128 voxels and more do not fit into what is stored: the distance is never said to be larger than it is.
TEST(DistanceField, IsTooSmallBeyondWhatIsStoredAndNeverTooLarge) {
  OccupancyGrid grid({0, 0, 0}, 0.1, Index3(262, 264, 266), Cell::free);
  grid.set({131, 131, 5}, Cell::occupied);
  const DistanceField field(grid);
  const auto expect_at = [&](const Index3& v, double expected) { EXPECT_NEAR(field.at(v), expected, 1e-5) << v; };
  expect_at({131, 131, 132}, 12.65);
  expect_at({131, 131, 133}, 12.75);
  expect_at({131, 131, 134}, 12.79990);  // 12.85 in truth
  for (const Index3& v : {Index3(131, 131, 134), Index3(130, 133, 140), Index3(131, 131, 133)}) {
    for (const Vec3& off : {Vec3(0.04, -0.03, 0.02), Vec3(0.0, 0.0, -0.049)}) {
      const Vec3 p = grid.center(v) + off;
      EXPECT_LE(field.exact(grid, p), brute_force(grid, p) + 1e-9);
      EXPECT_GT(field.exact(grid, p), 12.5);
    }
  }
}

TEST(DistanceField, InterpolatedStaysWithinSqrtThreeHalvesOfAVoxelOfExact) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int round = 0; round < 40; ++round) {
    const auto grid = random_grid(random, 14);
    const DistanceField field(grid);
    for (int i = 0; i < 200; ++i) {
      const Vec3 extent = grid.resolution() * grid.size().cast<double>();
      const Vec3 p = grid.origin() + extent.cwiseProduct(Vec3(unit(random), unit(random), unit(random)));
      ASSERT_NEAR(field.interpolated(p), field.exact(grid, p), std::sqrt(0.75) * grid.resolution());
    }
  }
}

TEST(DistanceField, InterpolatedPassesThroughTheCentresAndIsLinearBeforeAFlatWall) {
  OccupancyGrid grid({0, 0, 0}, 0.1, {60, 60, 60}, Cell::free);
  for (int k = 0; k < 60; ++k) {
    for (int j = 0; j < 60; ++j) grid.set({0, j, k}, Cell::occupied);
  }
  const DistanceField field(grid);
  for (double x = 0.151; x < 1.5; x += 0.013) {
    EXPECT_NEAR(field.interpolated({x, 3.0, 3.0}), x - 0.1, 1e-6) << x;
    EXPECT_NEAR((field.gradient({x, 3.0, 3.0}) - Vec3(1, 0, 0)).norm(), 0, 1e-5) << x;
  }
  EXPECT_EQ(field.interpolated({-0.01, 3, 3}), 0.0);
  EXPECT_EQ(field.interpolated({3, 3, 6.01}), 0.0);
  EXPECT_EQ(field.gradient({3, 3, 6.01}), Vec3::Zero());
  EXPECT_EQ(field.interpolated({std::nan(""), 3, 3}), 0.0);
}

TEST(DistanceField, GradientIsTheDerivativeOfInterpolated) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int checked = 0;
  for (int round = 0; round < 20; ++round) {
    const auto grid = random_grid(random, 14);
    const DistanceField field(grid);
    for (int i = 0; i < 100; ++i) {
      const Vec3 extent = grid.resolution() * grid.size().cast<double>();
      const Vec3 p = grid.origin() + extent.cwiseProduct(Vec3(unit(random), unit(random), unit(random)));
      const double step = 1e-4 * grid.resolution();
      const Vec3 q = (p - grid.origin()) / grid.resolution() - Vec3::Constant(0.5);
      const Vec3 in_cell = q.array() - q.array().floor();
      if (in_cell.minCoeff() < 1e-3 || in_cell.maxCoeff() > 1 - 1e-3) continue;  // kinks between cells
      const Vec3 edge = ((p - grid.origin()) / grid.resolution());
      if (edge.minCoeff() < 1e-3 || (grid.size().cast<double>() - edge).minCoeff() < 1e-3) continue;
      for (int axis = 0; axis < 3; ++axis) {
        const Vec3 d = step * Vec3::Unit(axis);
        const double slope = (field.interpolated(p + d) - field.interpolated(p - d)) / (2 * step);
        ASSERT_NEAR(field.gradient(p)[axis], slope, 1e-6);
        ++checked;
      }
    }
  }
  EXPECT_GT(checked, 3000);
}

}  // namespace
}  // namespace backwash::map
