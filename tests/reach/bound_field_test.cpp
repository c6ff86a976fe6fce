// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/planner.hpp"
#include "core/plan/world/world.hpp"
#include "core/reach/bound/bound_field.hpp"
#include "core/reach/bound/bound_tiles.hpp"
#include "tests/support/rounded_up.hpp"
#include "tests/support/stored_field.hpp"

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

/// Codes that are kept voxel by voxel.
struct Plain {
  Index3 size;
  std::vector<BoundCodes> codes;
  BoundCodes largest(const Index3& low, int edge) const {
    BoundCodes most{};
    map::for_each_voxel({low, (low + Index3::Constant(edge - 1)).cwiseMin(size - Index3::Ones())},
                        [&](const Index3& v) {
                          for (std::size_t d = 0; d < kDirections; ++d)
                            most[d] = std::max(most[d], codes[map::linear(size, v)][d]);
                        });
    return most;
  }
};

/// New codes at some voxels of a box, none at its others.
void change(BoundTiles& tiles, Plain& plain, const map::VoxelBox& box, std::mt19937& random) {
  std::vector<std::size_t> listed;
  map::for_each_voxel(box, [&](const Index3& v) {
    BoundCodes& codes = plain.codes[map::linear(plain.size, v)];
    codes = {};
    if (random() % 3 == 0) return;
    listed.push_back(map::linear(plain.size, v));
    for (BoundCode& code : codes) code = static_cast<BoundCode>(1 + random() % 65535);
  });
  const auto fill = [&](const auto& store) {
    for (const std::size_t n : listed) store(n, plain.codes[n]);
  };
  tiles.update(box, listed, fill, run_serial);
}

void expect_same(const BoundTiles& tiles, const Plain& plain) {
  BoundCodes largest{};
  for (std::size_t n = 0; n < plain.codes.size(); ++n) {
    const Index3 v = map::voxel(plain.size, n);
    for (int level = 0; level < BoundTiles::kLevels; ++level)
      ASSERT_EQ(tiles.at(v).level[static_cast<std::size_t>(level)], plain.largest(v, 1 << level))
          << v.transpose() << ", level " << level;
    for (std::size_t d = 0; d < kDirections; ++d) largest[d] = std::max(largest[d], plain.codes[n][d]);
  }
  ASSERT_EQ(tiles.largest(), largest);
}

TEST(BoundTiles, HoldTheMaximaOfAllCubesWhateverChangedAndCopiesStayAsTheyWere) {
  std::mt19937 random(4);
  for (const Index3& size : {Index3(37, 21, 18), Index3(16, 16, 16), Index3(3, 2, 1)}) {
    BoundTiles tiles(size);
    Plain plain{size, std::vector<BoundCodes>(static_cast<std::size_t>(size.prod()))};
    expect_same(tiles, plain);
    for (int round = 0; round < 12; ++round) {
      const BoundTiles old = tiles;
      const Plain before = plain;
      map::VoxelBox box;
      for (int corner = 0; corner < 2; ++corner) box.add(map::voxel(size, random() % plain.codes.size()));
      if (round == 0) box = map::all_of(size);
      change(tiles, plain, box, random);
      expect_same(tiles, plain);
      if (round % 4 == 3) expect_same(old, before);
    }
  }
}

/// Ranges of a few at a time, in an order that is not the rising one: what a range does must not depend on others.
void run_in_pieces(std::size_t count, const std::function<void(std::size_t, std::size_t)>& work) {
  constexpr std::size_t kPiece = 3;
  for (std::size_t first = 0; first < 2; ++first)
    for (std::size_t n = first * kPiece; n < count; n += 2 * kPiece) work(n, std::min(n + kPiece, count));
}

TEST(BoundTiles, OtherCodesAreThoseOfAnUpdateOfAllAndWhatNoneReachesStaysShared) {
  std::mt19937 random(5);
  const Index3 size(70, 37, 21);
  for (const Parallel& parallel : {Parallel(run_serial), Parallel(run_in_pieces)})
    for (const bool everywhere : {true, false}) {
      BoundTiles tiles(size);
      Plain plain{size, std::vector<BoundCodes>(static_cast<std::size_t>(size.prod()))};
      change(tiles, plain, map::all_of(size), random);
      const BoundTiles old = tiles;
      const Plain before = plain;
      // Where codes have an odd sum, or in one corner of one tile: its lowest, which cubes of seven others reach.
      const map::VoxelBox corner{{48, 16, 16}, {48, 16, 16}};
      const auto anew = [&](std::size_t n, const BoundCodes& codes) {
        EXPECT_EQ(codes, before.codes[n]);
        if (everywhere ? (codes[0] + codes[1]) % 2 == 0 : !corner.contains(map::voxel(size, n))) return codes;
        BoundCodes other = codes;
        for (BoundCode& code : other) code = static_cast<BoundCode>(std::max(1, everywhere ? code / 2 : 65535));
        return other;
      };
      for (std::size_t n = 0; n < plain.codes.size(); ++n)
        if (plain.codes[n] != BoundCodes{}) plain.codes[n] = anew(n, plain.codes[n]);
      tiles.recode(anew, parallel);
      expect_same(tiles, plain);
      expect_same(old, before);
      const auto shared = [&](const Index3& v) { return &tiles.at(v) == &old.at(v); };
      if (!everywhere) {
        EXPECT_TRUE(shared({5, 5, 5}));
        EXPECT_TRUE(shared({65, 30, 20}));
      }
    }
}

// Bounds are stored in 16 bits. No set may shrink by that: what is read is held against the field's own values in
// double precision.

/// Largest bound of the voxels from low to high, by its definition.
PerDirection largest(const field::DisturbanceField& field, const BoundModel& model, const Index3& low,
                     const Index3& high) {
  PerDirection maximum{};
  for (int k = low.z(); k <= high.z(); ++k)
    for (int j = low.y(); j <= high.y(); ++j)
      for (int i = low.x(); i <= high.x(); ++i) {
        if (!field.has({i, j, k})) continue;
        const DisturbanceBound w = bound(field.at({i, j, k}), model);
        for (std::size_t d = 0; d < kDirections; ++d) maximum[d] = std::max(maximum[d], w.w[d]);
      }
  return maximum;
}

/// Random boxes of up to `most` voxels an edge; the number of them that held a bound.
int expect_rounded_up(const plan::World& world, const Model& model, int boxes, int most, unsigned seed) {
  std::mt19937 random(seed);
  const field::DisturbanceField field = test::stored_field(world, model);
  int held = 0;
  for (int trial = 0; trial < boxes; ++trial) {
    Index3 low, high;
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::uniform_int_distribution<int>(0, world.grid.size()[axis] - 1)(random);
      high[axis] =
          std::min(low[axis] + std::uniform_int_distribution<int>(0, most - 1)(random), world.grid.size()[axis] - 1);
    }
    const bool one = trial % 4 == 0;
    if (one) high = low;
    const PerDirection w = largest(field, model.bound, low, high);
    const PerDirection read = one ? world.bounds.at(low).w : world.bounds.max_over_voxels(low, high).w;
    for (std::size_t d = 0; d < kDirections; ++d) {
      EXPECT_GE(read[d], w[d]);
      EXPECT_GE(static_cast<float>(read[d]), static_cast<float>(w[d]));
      EXPECT_LE(read[d], w[d] * (1 + std::ldexp(1.0, -11)));
    }
    held += w[kZ] > 0;
  }
  return held;
}

TEST(BoundCode, NoBoundReadFromARandomMapIsBelowTheFieldsOrATwoThousandthAboveIt) {
  Model model = *config::load_model("builtin:quad-5in");
  const Vehicle vehicle = *config::load_vehicle("builtin:quad-5in");
  model.bound = {2.7, 0.13, 0.21, 0.15};
  for (unsigned seed = 0; seed < 6; ++seed) {
    std::mt19937 random(seed);
    map::OccupancyGrid grid(Vec3(-1, 2, 0), 0.1, Index3(33, 26, 20), map::Cell::free);
    const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    for (int box = 0; box < 8; ++box) {
      const Index3 low(below(33), below(26), below(20)), extent(1 + below(6), 1 + below(6), 1 + below(9));
      const Index3 high = (low + extent).cwiseMin(grid.size());
      for (int k = low.z(); k < high.z(); ++k)
        for (int j = low.y(); j < high.y(); ++j)
          for (int i = low.x(); i < high.x(); ++i) grid.set({i, j, k}, map::Cell::occupied);
    }
    const auto world = plan::build_world(std::move(grid), model, vehicle);
    EXPECT_GT(expect_rounded_up(*world, model, 1000, 9, seed), 200);
  }
}

TEST(BoundCode, IsTheLeastOfTwelveSignificantBitsThatIsNotBelow) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> exponent(-15, 15.999);
  for (int trial = 0; trial < 100000; ++trial) {
    const double w = std::exp2(exponent(random));
    ASSERT_EQ(bound_of(code_of(w)), rounded_up(w)) << w;
  }
}

TEST(BoundCode, OfABoundThatACodeHasIsThatBoundAndTheOrderIsTheBounds) {
  double before = -1;
  for (unsigned code = 0; code < kUnbounded; ++code) {
    if (code > 0 && code < 2048) continue;  // below the least
    const double w = bound_of(static_cast<BoundCode>(code));
    ASSERT_GT(w, before);
    ASSERT_EQ(code_of(w), code);
    before = w;
    if (code == 0) continue;
    ASSERT_GT(code_of(std::nextafter(w, 1e300)), code);
    ASSERT_EQ(code_of(std::nextafter(w, 0)), code);
  }
}

TEST(BoundCode, ZeroStaysZeroAndWhatIsOutsideTheRangeGoesUp) {
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_EQ(bound_of(code_of(0)), 0);
  EXPECT_EQ(bound_of(code_of(std::numeric_limits<double>::denorm_min())), std::ldexp(1.0, -15));
  EXPECT_EQ(bound_of(code_of(std::ldexp(0.9, -15))), std::ldexp(1.0, -15));
  EXPECT_EQ(bound_of(code_of(std::ldexp(4094.0, 4))), std::ldexp(4094.0, 4));
  EXPECT_EQ(bound_of(code_of(std::ldexp(4094.5, 4))), infinite);
  EXPECT_EQ(bound_of(code_of(1e40)), infinite);
  EXPECT_EQ(bound_of(code_of(infinite)), infinite);
  EXPECT_EQ(bound_of(code_of(std::nan(""))), infinite);
}

TEST(BoundCode, AnInfiniteBoundLeavesNoPlaceToHover) {
  map::OccupancyGrid grid(Vec3::Zero(), 0.1, Index3(20, 20, 20), map::Cell::free);
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 20; ++j) grid.set({i, j, 0}, map::Cell::occupied);
  Model model = *config::load_model("builtin:quad-5in");
  model.bound.kappa = 1e12;
  for (const Method method : {Method::tight, Method::paper}) {
    const auto world = plan::build_world(grid, model, *config::load_vehicle("builtin:quad-5in"), method);
    EXPECT_EQ(world->bounds.at({10, 10, 10}).w[kX], std::numeric_limits<double>::infinity());
    EXPECT_FALSE(world->hover.safe({10, 10, 10}));
    EXPECT_FALSE(hover_extent(world->reach, world->grid, world->distance, world->bounds, Vec3::Constant(1.05)).bounded);
    EXPECT_FALSE(hover_set(world->reach, world->grid, world->distance, world->bounds, Vec3::Constant(1.05)).safe());
    const State there{Vec3::Constant(1.05)};
    const std::vector<Setpoint> held(10, Setpoint{there.p_W});
    EXPECT_LT(plan::lateral_clearance(*world, tube_over_field(world->reach, there, held.front(), held, world->bounds)),
              0);
    map::OccupancyGrid changed = grid;
    changed.set({5, 5, 5}, map::Cell::occupied);
    const auto updated = plan::rebuilt(*world, {.grid = changed, .voxels = {{5, 5, 5}, {5, 5, 5}}});
    EXPECT_FALSE(updated->hover.safe({10, 10, 10}));
  }
}

// Casts of what is no number to voxels differ from processor to processor: on one of them it was safe to hover there.
TEST(BoundCode, AnInfiniteBoundHasAnInfiniteEllipsoid) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const HoverEllipsoid ellipsoid(*config::load_vehicle("builtin:quad-5in"));
  for (const Vec3& w_bar :
       {Vec3(1, 1, kInfinity), Vec3(kInfinity, 1, 0), Vec3(0, kInfinity, 1), Vec3(kInfinity, kInfinity, kInfinity)})
    EXPECT_EQ(ellipsoid.half_axes(w_bar), Vec3::Constant(kInfinity));
}

}  // namespace
}  // namespace backwash::reach
