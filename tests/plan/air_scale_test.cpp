// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/world/air_scale.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/world/world.hpp"
#include "core/reach/clearance.hpp"
#include "tests/support/stored_field.hpp"

namespace backwash::plan {
namespace {

constexpr double kEdge = 0.2;
const AirFactors kRougher{1, 1.4142, 4, 2, 1};

Vehicle quad() { return config::load_vehicle("builtin:quad-5in").value(); }
/// A corridor with a box on its floor, so that every class is somewhere.
map::OccupancyGrid furnished() {
  map::OccupancyGrid grid = map::builtin_scene("parallel-walls-4m", kEdge).value();
  const Index3 low = grid.index({-0.3, -0.3, 0.1});
  for (int k = 0; k < 3; ++k)
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i) grid.set(low + Index3(i, j, k), map::Cell::occupied);
  return grid;
}
std::shared_ptr<const World> as_modelled() {
  static const auto world = build_world(furnished(), Model{}, quad());
  return world;
}
std::size_t counted(const World& world, AirClass air) {
  std::size_t n = 0;
  for (std::size_t v = 0; v < world.grid.cell_count(); ++v)
    n += world.air.sigma->has(world.grid.voxel(v)) && world.air.classes[v] == air;
  return n;
}

TEST(AirScale, TheClassOfAVoxelIsTheTermThatIsLargestInTheExactModel) {
  const auto world = rebuilt(*as_modelled(), {.air = kModelledAir});
  const field::ProximityField exact(world->grid, with_vehicle(Model{}, quad()));
  std::size_t compared = 0, close = 0;
  for (std::size_t n = 0; n < world->grid.cell_count(); n += 3) {
    const Index3 v = world->grid.voxel(n);
    if (!world->air.sigma->has(v)) continue;
    const auto parts = exact.at(world->grid.center(v));
    const AirClass expected = dominant(parts.base, parts.ground, parts.wall, parts.corner);
    ++compared;
    if (world->air.classes[n] == expected) continue;
    // Rounding may tell two terms apart that are equal to a millionth.
    const auto trace = [](const Variance& s) { return s.xx + s.yy + s.zz; };
    std::array<double, 4> traces{trace(parts.base), trace(parts.ground), trace(parts.wall), trace(parts.corner)};
    EXPECT_NEAR(traces[static_cast<std::size_t>(world->air.classes[n])], traces[static_cast<std::size_t>(expected)],
                1e-5 * *std::ranges::max_element(traces));
    ++close;
  }
  EXPECT_GT(compared, 200u);
  EXPECT_LE(close, compared / 100);
  for (const AirClass air : {AirClass::free_air, AirClass::ground, AirClass::wall})
    EXPECT_GT(counted(*world, air), 20u) << to_string(air);
}

TEST(AirScale, ABoundGrowsByTheRootOfItsClasssFactorAndTheSteadyPushDoesNot) {
  Model model;
  model.bound.mean_horizontal = 0.05;
  model.bound.mean_vertical = 0.02;
  const auto calm = build_world(furnished(), model, quad());
  const auto rough = rebuilt(*calm, {.air = kRougher});
  const field::DisturbanceField modelled = test::stored_field(*calm, model);
  std::size_t grown = 0;
  for (std::size_t n = 0; n < calm->grid.cell_count(); ++n) {
    const Index3 v = calm->grid.voxel(n);
    if (!rough->air.sigma->has(v)) continue;
    const double root = std::sqrt(kRougher[static_cast<std::size_t>(rough->air.classes[n])]);
    const auto before = bound(rough->air.sigma->at(v), model.bound);
    for (std::size_t d = 0; d < kDirections; ++d) {
      const double mean = d == kZ ? 0.02 : 0.05, expected = mean + root * (before.w[d] - mean);
      EXPECT_GE(rough->bounds.at(v).w[d], expected * (1 - 1e-6));
      EXPECT_LE(rough->bounds.at(v).w[d], expected * (1 + 1.1 * reach::kBoundGrowth));
    }
    grown += root > 1;
    EXPECT_EQ(rough->air.sigma->at(v).xx, modelled.at(v).xx) << "Σ is the model's";
    EXPECT_TRUE(calm->hover.safe(v) || !rough->hover.safe(v)) << "rougher air makes no place safe";
  }
  EXPECT_GT(grown, 100u);
}

TEST(AirScale, RougherAirTakesPlacesToHoverAwayAndWidensTheSetsThere) {
  const auto calm = as_modelled();
  const auto rough = rebuilt(*calm, {.air = AirFactors{4, 4, 4, 4, 1}});
  std::size_t lost = 0;
  for (std::size_t n = 0; n < calm->grid.cell_count(); ++n)
    lost += calm->hover.safe(calm->grid.voxel(n)) && !rough->hover.safe(rough->grid.voxel(n));
  EXPECT_GT(lost, 10u);
  // Half widths are linear in w̄: twice, where the air is one all over the set.
  const Vec3 p(-2, 0, 1.2);
  const auto before = reach::hover_set(calm->reach, calm->grid, calm->distance, calm->bounds, p);
  const auto after = reach::hover_set(rough->reach, rough->grid, rough->distance, rough->bounds, p);
  ASSERT_TRUE(before.safe() && after.bounded);
  EXPECT_GT(after.half_widths[kX], 1.95 * before.half_widths[kX]);
}

TEST(AirScale, AirAsModelledChangesNothing) {
  const auto world = rebuilt(*as_modelled(), {.air = kModelledAir});
  for (std::size_t n = 0; n < world->grid.cell_count(); ++n) {
    const Index3 v = world->grid.voxel(n);
    EXPECT_EQ(world->bounds.at(v).w, as_modelled()->bounds.at(v).w);
    EXPECT_EQ(world->hover.safe(v), as_modelled()->hover.safe(v));
  }
}

TEST(AirScale, WhatWasLearntWithoutAClassCountsForAll) {
  const auto all = rebuilt(*as_modelled(), {.air = AirFactors{4, 4, 4, 4, 1}});
  const auto none = rebuilt(*as_modelled(), {.air = AirFactors{1, 1, 1, 1, 4}});
  for (std::size_t n = 0; n < all->grid.cell_count(); ++n)
    EXPECT_EQ(none->bounds.at(none->grid.voxel(n)).w, all->bounds.at(all->grid.voxel(n)).w);
}

TEST(AirScale, APlaceHasTheModelsVarianceAndNoneBeyondTheMap) {
  const auto world = rebuilt(*as_modelled(), {.air = kRougher});
  const Vec3 p = world->grid.center(world->grid.index({-2, 0, 1.2}));
  const AirPlace here = air_at(world->air, world->grid, p);
  const Variance expected = test::stored_field(*as_modelled(), Model{}).at(world->grid.index(p));
  EXPECT_NEAR(here.sigma.x(), expected.xx, 1e-9);
  EXPECT_NEAR(here.sigma.z(), expected.zz, 1e-9);
  EXPECT_NE(here.air, AirClass::none);
  const AirPlace beyond = air_at(world->air, world->grid, {1000, 0, 1});
  EXPECT_EQ(beyond.sigma, Vec3(0, 0, 0));
  EXPECT_EQ(beyond.air, AirClass::none);
  EXPECT_EQ(air_at({}, world->grid, p).air, AirClass::none) << "nobody asked for classes";
}

// What is taken over from the world before must not show: its places to hover, while factors grow, and no more after a
// reset.
TEST(AirScale, TheWorldDependsOnTheFactorsAndNotOnThoseBefore) {
  const auto at_once = rebuilt(*as_modelled(), {.air = AirFactors{4, 4, 4, 4, 1}});
  const auto half_way = rebuilt(*as_modelled(), {.air = AirFactors{2, 1, 4, 1, 1}});
  const auto equal = [](const World& a, const World& b) {
    std::size_t differ = 0;
    for (std::size_t n = 0; n < a.grid.cell_count(); ++n) {
      const Index3 v = a.grid.voxel(n);
      differ += a.bounds.at(v).w != b.bounds.at(v).w || a.hover.safe(v) != b.hover.safe(v);
    }
    return differ == 0;
  };
  EXPECT_FALSE(equal(*half_way, *at_once));
  EXPECT_TRUE(equal(*rebuilt(*half_way, {.air = AirFactors{4, 4, 4, 4, 1}}), *at_once)) << "grown in two steps";
  EXPECT_TRUE(equal(*rebuilt(*at_once, {.air = AirFactors{2, 1, 4, 1, 1}}), *half_way)) << "some fell";
  EXPECT_TRUE(equal(*rebuilt(*at_once, {.air = kModelledAir}), *as_modelled())) << "a reset";
}

/// Everything of a world in this air by the long way: Σ scaled as a field, w̄ of all places, each hover set by itself.
void expect_made_anew(const World& world, const World& modelled, const AirFactors& factors) {
  AirScale scale = modelled.air;
  scale.factors = factors;
  EXPECT_EQ(world.air.factors, factors);
  EXPECT_EQ(world.air.classes, modelled.air.classes);
  field::DisturbanceField flown = *scale.sigma;
  for (std::size_t n = 0; n < modelled.grid.cell_count(); ++n) {
    if (!flown.has(modelled.grid.voxel(n))) continue;
    const Variance s = flown.at(n);
    const auto factor = static_cast<float>(factor_of(factors, scale.classes[n]));
    const auto single = [factor](double of_s) { return factor * static_cast<float>(of_s); };
    flown.set(n, {single(s.xx), single(s.xy), 0, single(s.yy), 0, single(s.zz)});
  }
  const reach::BoundField bounds(modelled.grid, flown, Model{}.bound);
  EXPECT_EQ(world.bounds.largest().w, bounds.largest().w);
  map::OccupancyGrid safe(modelled.grid.origin(), modelled.grid.resolution(), modelled.grid.size(), map::Cell::unknown);
  for (std::size_t n = 0; n < modelled.grid.cell_count(); ++n) {
    const Index3 v = modelled.grid.voxel(n);
    ASSERT_EQ(world.bounds.codes(v), bounds.codes(v)) << v.transpose();
    for (const int edge : {2, 3, 4, 6, 9}) {
      const Index3 high = v + Index3::Constant(edge - 1);
      ASSERT_EQ(world.bounds.max_over_voxels(v, high).w, bounds.max_over_voxels(v, high).w) << v.transpose();
    }
    const bool may =
        scale.sigma->has(v) && modelled.distance.at(v) > reach::body_and_estimation(modelled.reach.vehicle);
    const bool is =
        may &&
        reach::hover_set(modelled.reach, modelled.grid, modelled.distance, bounds, modelled.grid.center(v)).safe();
    ASSERT_EQ(world.hover.safe(v), is) << v.transpose();
    if (is) safe.set(v, map::Cell::free);
  }
  const SafeSpace space(safe);
  for (std::size_t n = 0; n < safe.cell_count(); ++n)
    ASSERT_EQ(world.safe.region(safe.voxel(n)), space.region(safe.voxel(n)));
}

// Only what a factor scales is made anew: bit for bit what all of it made anew is, whatever changed before and however
// the work is shared.
TEST(AirScale, AChangeOfFactorsGivesBitForBitWhatAllMadeAnewGives) {
  const auto in_pieces = [](std::size_t count, const std::function<void(std::size_t, std::size_t)>& work) {
    for (std::size_t n = 0; n < count; n += 7) work(n, std::min(n + 7, count));
  };
  const auto modelled = rebuilt(*as_modelled(), {.air = kModelledAir});
  auto world = modelled;
  const AirFactors steps[] = {{1, 1.1892, 1, 1, 1},
                              {1, 1.1892, 2.3784, 1, 1},
                              {3.3636, 1.4142, 2.3784, 8, 1},
                              {1, 1, 1, 1, 2.8284},
                              {8, 8, 8, 8, 8}};
  for (const AirFactors& factors : steps) {
    world = rebuilt(*world, {.air = factors}, factors[0] > 1 ? Parallel(in_pieces) : Parallel(run_serial));
    expect_made_anew(*world, *modelled, factors);
  }
}

}  // namespace
}  // namespace backwash::plan
