// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "core/field/disturbance_field.hpp"
#include "tests/field/brute_force.hpp"
#include "tests/field/scenes.hpp"

namespace backwash::field {
namespace {

using map::Cell;
using map::OccupancyGrid;

const Variance kFallback{7, 0.1, 0.2, 8, 0.3, 9};

std::vector<std::size_t> free_voxels(const OccupancyGrid& grid) {
  std::vector<std::size_t> voxels;
  for (std::size_t n = 0; n < grid.cell_count(); ++n)
    if (grid.at(n) == Cell::free) voxels.push_back(n);
  return voxels;
}

/// Σ_v w_v Σ(v) / Σ_v w_v with w the product of the hats 1 − |x|, over every voxel of the grid that is free.
Mat3 hat_average(const OccupancyGrid& grid, const ProximityField& exact, const Vec3& p) {
  Mat3 sum = Mat3::Zero();
  double weights = 0;
  for (const std::size_t n : free_voxels(grid)) {
    const Vec3 distance = (p - grid.center(grid.voxel(n))).cwiseAbs() / grid.resolution();
    if (distance.maxCoeff() >= 1) continue;
    const double weight = (Vec3::Ones() - distance).prod();
    sum += weight * oracle::matrix(exact.at(grid.center(grid.voxel(n))).sigma());
    weights += weight;
  }
  return weights > 0 ? Mat3(sum / weights) : oracle::matrix(kFallback);
}

TEST(DisturbanceField, InterpolatesWithTheWeightsOfFreeVoxelsRenormalised) {
  const OccupancyGrid grid = scene::random_map(3, 0.15);
  const ProximityField exact(grid, Model{});
  DisturbanceField field(grid, free_voxels(grid));
  field.fill(exact, free_voxels(grid));
  std::mt19937 random(1);
  std::uniform_real_distribution<double> u(-0.1, 1.1);
  int partial = 0;
  for (int n = 0; n < 300; ++n) {
    const Vec3 x = Vec3(u(random), u(random), u(random)).cwiseProduct(grid.size().cast<double>());
    const Vec3 p = grid.origin() + grid.resolution() * x;
    const Mat3 expected = hat_average(grid, exact, p);
    ASSERT_LE((oracle::matrix(field.interpolated(p, kFallback)) - expected).cwiseAbs().maxCoeff(),
              1e-6 * expected.cwiseAbs().maxCoeff())
        << p.transpose();
    partial += !grid.free(grid.index(p)) && expected != oracle::matrix(kFallback);
  }
  EXPECT_GT(partial, 10);
}

TEST(DisturbanceField, HoldsTheExactValueAtTheCentresOfFilledVoxelsOnly) {
  const OccupancyGrid grid = scene::random_map(4, 0.15);
  const ProximityField exact(grid, Model{});
  const auto voxels = free_voxels(grid);
  DisturbanceField field(grid, voxels);
  field.fill(exact, std::span(voxels).first(voxels.size() / 2));
  for (std::size_t n = 0; n < voxels.size(); ++n) {
    const Index3 v = grid.voxel(voxels[n]);
    ASSERT_EQ(field.has(v), n < voxels.size() / 2);
    if (!field.has(v)) continue;
    const Mat3 expected = oracle::matrix(exact.at(grid.center(v)).sigma());
    const double tolerance = 1e-6 * expected.cwiseAbs().maxCoeff();
    ASSERT_LE((oracle::matrix(field.at(v)) - expected).cwiseAbs().maxCoeff(), tolerance);
    ASSERT_LE((oracle::matrix(field.interpolated(grid.center(v), kFallback)) - expected).cwiseAbs().maxCoeff(),
              tolerance);
  }
  EXPECT_FALSE(field.has(Index3(-1, 0, 0)));
  EXPECT_FALSE(field.has(grid.size()));
}

TEST(DisturbanceField, GivesTheFallbackWhereNothingIsStored) {
  const OccupancyGrid grid(Vec3::Zero(), 0.1, Index3(5, 5, 5), Cell::free);
  DisturbanceField field(grid, free_voxels(grid));
  const Vec3 inside(0.22, 0.27, 0.31);
  EXPECT_EQ(field.interpolated(inside, kFallback).zz, 9);
  const ProximityField exact(grid, Model{});
  field.fill(exact, free_voxels(grid));
  EXPECT_NEAR(field.interpolated(inside, kFallback).zz, Model{}.base.vertical, 1e-9);
  for (const Vec3& p : {Vec3(-1, 0.2, 0.2), Vec3(0.2, 0.2, 0.56), Vec3(1e300, 0, 0), Vec3(0, -1e300, 0)})
    EXPECT_EQ(field.interpolated(p, kFallback).zz, 9) << p.transpose();
}

}  // namespace
}  // namespace backwash::field
