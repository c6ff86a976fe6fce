// SPDX-License-Identifier: BSD-3-Clause
// Worlds in which what is unknown below free voxels is taken for a floor (Model::unknown_floor).
#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <utility>

#include "core/config/config.hpp"
#include "core/plan/world/world.hpp"

namespace backwash::plan {
namespace {

using map::Cell;
using map::OccupancyGrid;

const AirFactors kFloorRougher{3, 2, 4, 1, 1};

Vehicle quad_5in() { return config::load_vehicle("builtin:quad-5in").value(); }
Model floor_model() {
  Model model;
  model.unknown_floor = true;
  return model;
}

void expect_same_world(const World& a, const World& b) {
  for (std::size_t n = 0; n < b.grid.cell_count(); ++n) {
    const Index3 v = b.grid.voxel(n);
    ASSERT_EQ(a.grid.at(n), b.grid.at(n));
    ASSERT_EQ(a.bounds.at(v).w, b.bounds.at(v).w) << v.transpose();
    ASSERT_EQ(a.hover.safe(v), b.hover.safe(v)) << v.transpose();
    if (!b.air.known() || !b.air.sigma->has(v)) continue;
    ASSERT_EQ(a.air.classes[n], b.air.classes[n]) << v.transpose();
    ASSERT_EQ(a.air.sigma->at(v).zz, b.air.sigma->at(v).zz) << v.transpose();
  }
}

// Any change of any voxel, the lowest layer's as well, in air as modelled and in rougher air.
TEST(UnknownFloor, AWorldUpdatedByRegionIsTheWorldBuiltAnew) {
  const Model model = floor_model();
  for (const bool rougher : {false, true}) {
    std::mt19937 random(rougher ? 2 : 1);
    const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    const auto in_air = [&](std::shared_ptr<const World> world) {
      return rougher ? rebuilt(*world, {.air = kFloorRougher}) : world;
    };
    OccupancyGrid grid(Vec3::Zero(), 0.2, Index3(36, 30, 14), Cell::free);
    for (int n = 0; n < 36 * 30; ++n) grid.set({n % 36, n / 36, 0}, static_cast<Cell>(below(3)));
    auto world = in_air(build_world(grid, model, quad_5in()));
    std::size_t differ = 0;
    for (int round = 0; round < 9; ++round) {
      map::VoxelBox changed;
      const Index3 low(below(36), below(30), round % 3 == 0 ? 0 : below(10));
      const auto cell = static_cast<Cell>(round % 3);
      for (int n = 0; n < 60; ++n) {
        const Index3 v = low + Index3(below(5), below(5), below(4));
        if (!grid.inside(v) || grid.at(v) == cell) continue;
        grid.set(v, cell);
        changed.add(v);
      }
      const auto before = std::exchange(world, rebuilt(*world, {.grid = grid, .voxels = changed}));
      const auto anew = in_air(build_world(grid, model, quad_5in()));
      expect_same_world(*world, *anew);
      if (HasFatalFailure()) return;
      for (std::size_t n = 0; n < grid.cell_count(); ++n)
        differ += before->bounds.at(grid.voxel(n)).w != anew->bounds.at(grid.voxel(n)).w;
    }
    EXPECT_GT(differ, 1000u);
  }
}

// Where the lowest layer is free, too: what is below a map is as unknown as what is in it.
TEST(UnknownFloor, BelowTheLowestLayerOfAMapAFloorMayBeAsWell) {
  OccupancyGrid cut(Vec3::Zero(), 0.2, Index3(20, 20, 8), Cell::free);
  OccupancyGrid whole({0, 0, -0.2}, 0.2, Index3(20, 20, 9), Cell::free);
  for (int n = 0; n < 400; ++n) whole.set({n % 20, n / 20, 0}, Cell::unknown);
  for (const bool rougher : {false, true}) {
    const auto made = [&](const OccupancyGrid& grid, const Model& model) {
      auto world = build_world(grid, model, quad_5in());
      return rougher ? rebuilt(*world, {.air = kFloorRougher}) : world;
    };
    const auto of_cut = made(cut, floor_model()), of_whole = made(whole, floor_model()), without = made(cut, Model{});
    for (std::size_t n = 0; n < cut.cell_count(); ++n) {
      const Index3 v = cut.voxel(n), w = v + Index3::UnitZ();
      ASSERT_EQ(of_cut->bounds.at(v).w, of_whole->bounds.at(w).w) << v.transpose();
      if (!rougher) continue;
      ASSERT_EQ(of_cut->air.classes[n], of_whole->air.classes[whole.linear(w)]) << v.transpose();
    }
    const Index3 low(10, 10, 2);
    EXPECT_GT(of_cut->bounds.at(low).w[kZ], 2 * without->bounds.at(low).w[kZ]);
  }
}

// What was learnt over a floor counts over one that is only taken for it: class and bounds are those of a known floor.
TEST(UnknownFloor, InLearntAirIsTheGroundThatAKnownOneIs) {
  OccupancyGrid known(Vec3::Zero(), 0.2, Index3(30, 30, 10), Cell::free), unknown = known;
  for (int n = 0; n < 900; ++n) {
    known.set({n % 30, n / 30, 0}, Cell::occupied);
    unknown.set({n % 30, n / 30, 0}, Cell::unknown);
  }
  const auto learnt = [](const OccupancyGrid& grid) {
    return rebuilt(*build_world(grid, floor_model(), quad_5in()), {.air = AirFactors{1, 2, 1, 1, 1}});
  };
  const auto over_known = learnt(known), over_unknown = learnt(unknown);
  std::size_t ground = 0;
  for (int k = 2; k < 8; ++k) {
    const Index3 v(15, 15, k);
    const AirClass air = over_known->air.classes[known.linear(v)];
    ground += air == AirClass::ground;
    EXPECT_EQ(over_unknown->air.classes[unknown.linear(v)], air) << k;
    EXPECT_EQ(over_unknown->bounds.at(v).w, over_known->bounds.at(v).w) << k;
  }
  EXPECT_GT(ground, 1u);
}

}  // namespace
}  // namespace backwash::plan
