// SPDX-License-Identifier: BSD-3-Clause
// The bound of a model with mean pushes: how far the disturbance of any voxel in a box can lie from the push that the
// centre is moved by.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/reach/bound/bound_field.hpp"
#include "tests/support/rounded_up.hpp"

namespace backwash::reach {
namespace {

constexpr double kDragError = 0.07, kLiftError = 0.05;

/// Pushes that differ from place to place under the ceiling and along the wall, and pushes by velocity; none is exact.
Model pushing_model() {
  Model model;
  model.extension = {{Law::push_under_surface, Vec3(0.6, 0, 0), Vec3(0.2, 0, 0), 0.4},
                     {Law::push_to_walls, Vec3(-0.4, 0, 0), Vec3(0.1, 0, 0), 0.5},
                     {Law::push_against_velocity, Vec3(0.3, 0, 0), Vec3(kDragError, 0, 0), 0},
                     {Law::push_with_speed, Vec3(0.2, 0, 0), Vec3(kLiftError, 0, 0), 0}};
  return model;
}

/// 1.6 × 2 × 1.6 m with a floor, a ceiling and a wall at y = 2 m; everything free is stored.
struct ExtendedScene {
  ExtendedScene()
      : grid(Vec3::Zero(), 0.1, Index3(16, 20, 16), map::Cell::free), field(stored()), extension(grid, model) {
    extension.fill(grid, voxels);
  }
  Model model = pushing_model();
  map::OccupancyGrid grid;
  std::vector<std::size_t> voxels;
  field::DisturbanceField field;
  field::Extension extension;

 private:
  field::DisturbanceField stored() {
    for (std::size_t n = 0; n < grid.cell_count(); ++n) {
      const Index3 v = grid.voxel(n);
      if (v.z() == 0 || v.z() == 15 || v.y() == 19)
        grid.set(v, map::Cell::occupied);
      else
        voxels.push_back(n);
    }
    field::DisturbanceField result(grid, voxels);
    result.fill(field::ProximityField(grid, model), voxels);
    return result;
  }
};

/// Largest distance from `push` that the disturbance may have in the voxels from low to high, by its definition.
PerDirection brute_force(const ExtendedScene& scene, const Vec3& push, const Vec3& velocity, const Index3& low,
                         const Index3& high) {
  const Vec3 by_velocity(-0.3 * velocity.x(), -0.3 * velocity.y(), 0.2 * velocity.squaredNorm());
  PerDirection largest{};
  for (std::size_t n = 0; n < scene.grid.cell_count(); ++n) {
    const Index3 v = scene.grid.voxel(n);
    if (!scene.field.has(v) || (v.array() < low.array()).any() || (v.array() > high.array()).any()) continue;
    const Air air = scene.extension.at(v);
    const DisturbanceBound w = bound(scene.field.at(v), scene.model.bound);
    for (std::size_t d = 0; d < kDirections; ++d) {
      const double stored = rounded_up(w.w[d] + (d == kZ ? air.vertical : air.level));
      const double unknown =
          d == kZ ? kLiftError * velocity.squaredNorm() : kDragError * std::hypot(velocity.x(), velocity.y());
      const double off = unit(static_cast<Direction>(d)).dot(air.push_W + by_velocity - push);
      largest[d] = std::max(largest[d], std::abs(off) + stored + unknown);
    }
  }
  return largest;
}

TEST(ExtendedBounds, OverASmallBoxAreTheLargestDistanceOfAnyVoxelsDisturbanceFromThePush) {
  const ExtendedScene scene;
  const BoundField bounds(scene.grid, scene.field, scene.model.bound, scene.extension);
  std::mt19937 random(1);
  std::uniform_int_distribution<int> at(1, 14), extent(0, 5);
  std::uniform_real_distribution<double> speed(-1.5, 1.5);
  for (int trial = 0; trial < 300; ++trial) {
    const Index3 low(at(random), at(random), at(random)),
        high = low + Index3(extent(random), extent(random), extent(random));
    const Vec3 velocity(speed(random), speed(random), speed(random));
    const Vec3 push = bounds.push(scene.grid.center(low), velocity);
    const PerDirection actual = bounds.max_about_voxels(push, velocity, low, high).w;
    const PerDirection expected = brute_force(scene, push, velocity, low, high);
    for (std::size_t d = 0; d < kDirections; ++d) ASSERT_NEAR(actual[d], expected[d], 1e-5 * expected[d]) << trial;
  }
}

TEST(ExtendedBounds, OverALargeBoxAreNoLessThanThat) {
  const ExtendedScene scene;
  const BoundField bounds(scene.grid, scene.field, scene.model.bound, scene.extension);
  std::mt19937 random(2);
  std::uniform_int_distribution<int> at(0, 6), extent(8, 12);
  for (int trial = 0; trial < 50; ++trial) {
    const Index3 low(at(random), at(random), at(random)),
        high = low + Index3(extent(random), extent(random), extent(random));
    const Vec3 velocity(0.5, -1, 0.3), push = bounds.push(scene.grid.center((low + high) / 2), velocity);
    const PerDirection actual = bounds.max_about_voxels(push, velocity, low, high).w;
    const PerDirection least = brute_force(scene, push, velocity, low, high);
    for (std::size_t d = 0; d < kDirections; ++d) ASSERT_GE(actual[d], least[d] * (1 - 1e-5)) << trial;
  }
}

}  // namespace
}  // namespace backwash::reach
