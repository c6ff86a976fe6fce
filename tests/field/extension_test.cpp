// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/extension.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace backwash::field {
namespace {

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
