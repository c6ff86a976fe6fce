// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/bound/bound_field.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "tests/support/rounded_up.hpp"

namespace backwash::reach {
namespace {

/// Free space with scattered occupied voxels, and Σ stored at part of the free ones only.
struct Scene {
  map::OccupancyGrid grid;
  field::DisturbanceField field;
};

Scene random_scene(std::mt19937& random, const Index3& size, double resolution) {
  map::OccupancyGrid grid(Vec3(-1.0, 0.5, 2.0), resolution, size, map::Cell::free);
  std::bernoulli_distribution occupied(0.01), stored(0.3);
  std::vector<std::size_t> voxels;
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    if (occupied(random)) {
      grid.set(grid.voxel(n), map::Cell::occupied);
    } else if (stored(random)) {
      voxels.push_back(n);
    }
  }
  field::DisturbanceField field(grid, voxels);
  field.fill(field::ProximityField(grid, Model{}), voxels);
  return {std::move(grid), std::move(field)};
}

/// Definition: every voxel of the grid, closed, against the closed box; the largest rounded up as it is stored.
PerDirection brute_force(const Scene& scene, const BoundModel& model, const Vec3& low, const Vec3& high) {
  PerDirection maximum{};
  const double a = scene.grid.resolution();
  for (std::size_t n = 0; n < scene.grid.cell_count(); ++n) {
    const Index3 v = scene.grid.voxel(n);
    const Vec3 corner = scene.grid.origin() + a * v.cast<double>();
    const bool meets = (corner.array() <= high.array()).all() && ((corner.array() + a) >= low.array()).all();
    if (!meets || !scene.field.has(v)) continue;
    const DisturbanceBound w = bound(scene.field.at(v), model);
    for (std::size_t d = 0; d < kDirections; ++d) maximum[d] = std::max(maximum[d], w.w[d]);
  }
  for (double& w : maximum) w = rounded_up(w);
  return maximum;
}

void expect_equal(const PerDirection& actual, const PerDirection& expected) {
  for (std::size_t d = 0; d < kDirections; ++d) EXPECT_NEAR(actual[d], expected[d], 1e-6 * expected[d]);
}

TEST(BoundField, MaximumOverABoxEqualsBruteForce) {
  std::mt19937 random(1);
  const BoundModel model{3.0, 0.1, 0.2, 0.15};
  for (const Index3& size : {Index3(23, 17, 12), Index3(9, 31, 5), Index3(3, 2, 40)}) {
    const Scene scene = random_scene(random, size, 0.1);
    const BoundField bounds(scene.grid, scene.field, model);
    const Vec3 extent = 0.1 * size.cast<double>();
    std::uniform_real_distribution<double> where(-0.2, 1.2), half(0.0, 0.6);
    for (int trial = 0; trial < 300; ++trial) {
      const Vec3 p = scene.grid.origin() + extent.cwiseProduct(Vec3(where(random), where(random), where(random)));
      const Vec3 h = trial % 3 == 0 ? Vec3::Constant(half(random)) : Vec3(half(random), half(random), half(random));
      expect_equal(bounds.max_over(p - h, p + h).w, brute_force(scene, model, p - h, p + h));
    }
  }
}

TEST(BoundField, CountsVoxelsThatOnlyTouchTheBox) {
  std::mt19937 random(2);
  const Scene scene = random_scene(random, Index3(12, 12, 12), 0.125);  // faces are exact in binary
  const BoundField bounds(scene.grid, scene.field, BoundModel{});
  std::uniform_int_distribution<int> index(0, 11), length(0, 5);
  for (int trial = 0; trial < 300; ++trial) {
    const Vec3 low = scene.grid.origin() + 0.125 * Vec3(index(random), index(random), index(random));
    const Vec3 high = low + 0.125 * Vec3(length(random), length(random), length(random));
    expect_equal(bounds.max_over(low, high).w, brute_force(scene, BoundModel{}, low, high));
  }
}

TEST(BoundField, IsZeroOutsideTheGridAndAtUnstoredVoxels) {
  std::mt19937 random(3);
  const Scene scene = random_scene(random, Index3(10, 10, 10), 0.1);
  const BoundField bounds(scene.grid, scene.field, BoundModel{});
  for (std::size_t n = 0; n < scene.grid.cell_count(); ++n) {
    const Index3 v = scene.grid.voxel(n);
    PerDirection expected = scene.field.has(v) ? bound(scene.field.at(v), BoundModel{}).w : PerDirection{};
    for (double& w : expected) w = rounded_up(w);
    expect_equal(bounds.at(v).w, expected);
  }
  EXPECT_EQ(bounds.at(Index3(-1, 0, 0)).w, PerDirection{});
  EXPECT_EQ(bounds.at(Index3(0, 10, 0)).w, PerDirection{});
  EXPECT_EQ(bounds.max_over(Vec3(50, 50, 50), Vec3(51, 51, 51)).w, PerDirection{});
}

TEST(BoundField, BoxOfAnySizeIsInRange) {
  std::mt19937 random(4);
  const Scene scene = random_scene(random, Index3(10, 11, 12), 0.1);
  const BoundField bounds(scene.grid, scene.field, BoundModel{});
  const Vec3 huge = Vec3::Constant(1e12);
  expect_equal(bounds.max_over(-huge, huge).w, brute_force(scene, BoundModel{}, -huge, huge));
}

}  // namespace
}  // namespace backwash::reach
