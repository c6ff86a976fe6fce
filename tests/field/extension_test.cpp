// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/extension.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace backwash::field {
namespace {

using Kind = ModelEffect::Kind;

// A ceiling whose underside is at 1.5 m and a wall whose face is at y = 1.9 m; nothing else is near.
TEST(Extension, WhatIsKnownAndWhatIsNotFadesFromItsSurfaceByTheModelsLength) {
  map::OccupancyGrid grid(Vec3::Zero(), 0.1, Index3(30, 20, 16), map::Cell::free);
  for (int i = 0; i < 30; ++i) {
    for (int j = 0; j < 20; ++j) grid.set({i, j, 15}, map::Cell::occupied);
    for (int k = 0; k < 16; ++k) grid.set({i, 19, k}, map::Cell::occupied);
  }
  Model model;
  model.extension = {{Kind::push_under_surface, Vec3(0.6, 0, 0), Vec3(0.2, 0, 0), 0.4},
                     {Kind::push_to_walls, Vec3(0.5, 0, 0), Vec3(0.1, 0, 0), 0.5},
                     {Kind::ln_variance_under_surface, Vec3(0.7, 0, 0), Vec3(0.3, 0, 0), 0.8}};
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
  const std::vector<ModelEffect> effects{{Kind::push_against_velocity, Vec3(0.3, 0, 0), Vec3(0.05, 0, 0), 0}};
  const Air air = air_moving(effects, {3, -4, 2});
  EXPECT_LT((air.push_W - Vec3(-0.9, 1.2, 0)).norm(), 1e-12);
  EXPECT_NEAR(air.level, 0.05 * 5, 1e-12);
}

}  // namespace
}  // namespace backwash::field
