// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "core/field/disturbance_field.hpp"
#include "core/field/extension.hpp"
#include "tests/field/brute_force.hpp"
#include "tests/field/scenes.hpp"

namespace backwash::field {
namespace {

using map::Cell;
using map::OccupancyGrid;
using scene::free_voxels;

const Variance kFallback{7, 0.1, 0.2, 8, 0.3, 9};

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

// A ceiling whose underside is at 1.5 m and a wall whose face is at y = 1.9 m; nothing else is near.
TEST(Extension, WhatIsKnownAndWhatIsNotFadesFromItsSurfaceByTheModelsLength) {
  map::OccupancyGrid grid(Vec3::Zero(), 0.1, Index3(30, 20, 16), map::Cell::free);
  for (int i = 0; i < 30; ++i) {
    for (int j = 0; j < 20; ++j) grid.set({i, j, 15}, map::Cell::occupied);
    for (int k = 0; k < 16; ++k) grid.set({i, 19, k}, map::Cell::occupied);
  }
  Model model;
  model.extension = {{Law::push_under_surface, Vec3(0.6, 0, 0), Vec3(0.2, 0, 0), 0.4},
                     {Law::push_to_walls, Vec3(0.5, 0, 0), Vec3(0.1, 0, 0), 0.5},
                     {Law::ln_variance_under_surface, Vec3(0.7, 0, 0), Vec3(0.3, 0, 0), 0.8}};
  Extension extension(grid, model);
  const Index3 v(15, 14, 7);
  extension.fill(grid, std::vector<std::size_t>{grid.linear(v)});
  const Air air = extension.at(v);
  const double to_ceiling = 1.5 - 0.75, to_wall = 1.9 - 1.45;
  const double below = std::exp(-(to_ceiling - 0.3) / 0.4), beside = std::exp(-(to_wall - 0.4) / 0.5);
  EXPECT_NEAR(air.push_W.z(), 0.6 * below, 1e-6);
  EXPECT_NEAR(air.vertical, 0.2 * below, 1e-6);
  EXPECT_NEAR(air.push_W.y(), 0.5 * beside, 1e-6) << "towards the wall";
  EXPECT_NEAR(air.level, 0.1 * beside, 1e-6);
  EXPECT_NEAR(air.ln_variance, (0.7 + 0.3) * std::exp(-(to_ceiling - 0.3) / 0.8), 1e-6);
}

TEST(Extension, DragActsAgainstTheVelocityAndIsKnownUpToItsError) {
  const std::vector<ModelEffect> effects{{Law::push_against_velocity, Vec3(0.3, 0, 0), Vec3(0.05, 0, 0), 0}};
  const Air air = air_moving(effects, {3, -4, 2});
  EXPECT_LT((air.push_W - Vec3(-0.9, 1.2, 0)).norm(), 1e-12);
  EXPECT_NEAR(air.level, 0.05 * 5, 1e-12);
}

TEST(Extension, AClimbIsPushedDownAndTheErrorIsOfEitherSign) {
  const std::vector<ModelEffect> effects{{Law::push_against_climb, Vec3(0.3, 0, 0), Vec3(0.05, 0, 0), 0}};
  EXPECT_LT((air_moving(effects, {3, -4, 2}).push_W - Vec3(0, 0, -0.6)).norm(), 1e-12);
  EXPECT_NEAR(air_moving(effects, {3, -4, -2}).vertical, 0.05 * 2, 1e-12);
}

// Of any law: twice the value is twice the push, and an error as large as the value leaves all of the push open.
TEST(Laws, AreLinearInTheirValuesAndLeaveOpenWhatTheirErrorsSay) {
  Around around{0.5, 0.6, {{0.7, Vec3(1, 0, 0)}, {0.4, Vec3(0, -1, 0)}}};
  const Vec3 v_W(0.4, -0.3, 0.7), numbers(0.5, 0.25, 0.125);
  for (const LawEntry& law : kLaws) {
    const auto air = [&](const Vec3& value, const Vec3& error) {
      const std::vector<ModelEffect> one{{law.law, value, error, 0.8}};
      return law.at ? air_around(one, around) : air_moving(one, v_W);
    };
    const Air known = air(numbers, Vec3::Zero()), twice = air(2 * numbers, Vec3::Zero()),
              open = air(Vec3::Zero(), numbers);
    EXPECT_TRUE(twice.push_W.isApprox(2 * known.push_W, 1e-12)) << law.name;
    EXPECT_NEAR(twice.ln_variance, 2 * known.ln_variance, 1e-12) << law.name;
    EXPECT_EQ(known.level + known.vertical, 0) << law.name;
    EXPECT_GE(open.level, known.push_W.head<2>().norm() - 1e-12) << law.name;
    EXPECT_GE(open.vertical, std::abs(known.push_W.z()) - 1e-12) << law.name;
    EXPECT_EQ(open.ln_variance, known.ln_variance) << law.name << ": the variance counts at its larger end";
    EXPECT_EQ(law.of_variance, known.ln_variance != 0) << law.name;
    EXPECT_EQ(law.of_variance, known.push_W.isZero()) << law.name;
  }
}

}  // namespace
}  // namespace backwash::field
