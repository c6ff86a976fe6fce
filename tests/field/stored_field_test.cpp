// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <random>

#include "core/field/disturbance_field.hpp"
#include "core/field/field_update.hpp"
#include "core/map/load_map.hpp"
#include "tests/field/brute_force.hpp"
#include "tests/field/scenes.hpp"
#include "tests/support/changed_box.hpp"

namespace backwash::field {
namespace {

using map::Cell;
using map::OccupancyGrid;
using scene::free_voxels;

double difference(const Mat3& actual, const Mat3& expected) {
  return (actual - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff();
}

/// Models that reach every branch of the gates: the default; angles beyond a right angle, a footprint wider than the
/// cone, a steep decay; and walls seen from above only.
std::vector<Model> models() {
  Model wide, steep;
  wide.ground.theta_max = 2.5;
  wide.ground.r0 = 0.8;
  wide.ground.l_max = 0.6;
  wide.corner.phi_max = 2.2;
  wide.corner.l_max = 2.0;
  wide.wall.theta_min = 0;
  wide.wall.k2 = 40;
  steep.wall.theta_min = 1.5;
  steep.wall.l_max = 0.8;
  steep.corner.phi_max = 0.5;
  steep.ground.theta_max = 0.2;
  return {Model{}, wide, steep};
}

TEST(StoredField, EqualsTheExactFieldAtEveryFreeVoxelOfRandomMaps) {
  for (unsigned seed = 20; seed < 29; ++seed) {
    const OccupancyGrid grid = scene::random_map(seed, seed % 2 ? 0.08 : 0.15);
    const Model model = models()[seed % 3];
    const ProximityField exact(grid, model);
    const auto voxels = free_voxels(grid);
    const WholeField whole(grid, model, voxels);
    std::size_t count = 0;
    whole.evaluate(0, whole.block_count(), [&](std::size_t n, const Variance& sigma) {
      ++count;
      const Index3 q = grid.voxel(n);
      EXPECT_LE(difference(oracle::matrix(sigma), oracle::matrix(exact.at(grid.center(q)).sigma())), 1e-6)
          << "seed " << seed << ", voxel " << q.transpose();
    });
    EXPECT_EQ(count, voxels.size());
  }
}

void expect_exact_at_samples(const OccupancyGrid& grid, std::size_t samples) {
  auto voxels = free_voxels(grid);
  const Model model;
  const ProximityField exact(grid, model);
  std::shuffle(voxels.begin(), voxels.end(), std::mt19937(7));
  voxels.resize(samples);
  const WholeField whole(grid, model, voxels);
  DisturbanceField field(grid, voxels);
  field.fill(whole, 0, whole.block_count());
  for (const std::size_t n : voxels) {
    const Index3 q = grid.voxel(n);
    ASSERT_TRUE(field.has(q));
    EXPECT_LE(difference(oracle::matrix(field.at(q)), oracle::matrix(exact.at(grid.center(q)).sigma())), 1e-6)
        << "voxel " << q.transpose();
  }
}

// A window that never showed the floor: where it ends below is taken for one. Everything else is as before.
TEST(StoredField, TakesWhatIsUnknownBelowForAFloorWhereItIsToldTo) {
  Model model;
  model.unknown_floor = true;
  OccupancyGrid grid(Vec3::Zero(), 0.1, Index3(24, 22, 20), Cell::unknown), floored = grid;
  for (OccupancyGrid* g : {&grid, &floored})
    scene::paint(*g, Cell::free, [](const Vec3& x) { return (x.array() > 0.3).all() && x.z() < 1.7; });
  scene::paint(floored, Cell::occupied, [](const Vec3& x) { return x.z() < 0.3; });
  const auto voxels = free_voxels(grid);
  const WholeField whole(grid, model, voxels);
  const ProximityField exact(grid, model), with_floor(floored, Model{}), without(grid, Model{});
  double more = 0;
  whole.evaluate(0, whole.block_count(), [&](std::size_t n, const Variance& sigma) {
    const Vec3 p = grid.center(grid.voxel(n));
    const Mat3 expected = oracle::matrix(with_floor.at(p).sigma());
    EXPECT_LE(difference(oracle::matrix(sigma), expected), 1e-6) << p.transpose();
    EXPECT_LE(difference(oracle::matrix(exact.at(p).sigma()), expected), 1e-12) << p.transpose();
    more = std::max(more, sigma.zz / without.at(p).sigma().zz);
  });
  EXPECT_GT(more, 10);
  for (unsigned seed = 40; seed < 44; ++seed) {
    const OccupancyGrid random = scene::random_map(seed, 0.12);
    const auto listed = free_voxels(random);
    const WholeField all(random, model, listed);
    const ProximityField one(random, model);
    all.evaluate(0, all.block_count(), [&](std::size_t n, const Variance& sigma) {
      if (n % 7 != seed % 7) return;
      const Vec3 p = random.center(random.voxel(n));
      EXPECT_LE(difference(oracle::matrix(sigma), oracle::matrix(one.at(p).sigma())), 1e-6) << seed;
    });
  }
}

TEST(StoredField, EqualsTheExactFieldInEveryBuiltInScene) {
  auto names = map::builtin_scene_names();
  std::erase_if(names, [](const std::string& name) { return name.starts_with("forest"); });
  names.push_back("forest-1");
  ASSERT_GT(names.size(), 6u);
  for (const std::string& name : names) {
    SCOPED_TRACE(name);
    expect_exact_at_samples(*map::builtin_scene(name, 0.1), 500);
  }
}

TEST(StoredField, EqualsTheExactFieldInRoomsTurnedByAnyAngle) {
  for (const double degrees : {0.0, 7.0, 23.0, 45.0, 68.0}) {
    SCOPED_TRACE(degrees);
    expect_exact_at_samples(scene::turned_room(degrees * std::numbers::pi / 180, 0.08), 2000);
  }
}

TEST(StoredField, EqualsTheExactFieldInTheTwoLayersOfASliceOfATurnedRoom) {
  const OccupancyGrid grid = scene::turned_room(23 * std::numbers::pi / 180, 0.08);
  auto voxels = free_voxels(grid);
  std::erase_if(voxels, [&](std::size_t n) { return grid.voxel(n).z() < 11 || grid.voxel(n).z() > 12; });
  ASSERT_GT(voxels.size(), 500u);
  const WholeField whole(grid, Model{}, voxels);
  DisturbanceField by_blocks(grid, voxels), one_by_one(grid, voxels);
  by_blocks.fill(whole, 0, whole.block_count());
  one_by_one.fill(ProximityField(grid, Model{}), voxels);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> within(-0.5, 0.5);
  for (int n = 0; n < 2000; ++n) {
    const Index3 v = grid.voxel(voxels[random() % voxels.size()]);
    Vec3 p = grid.center(v) + 0.08 * Vec3(within(random), within(random), 0);
    p.z() = grid.origin().z() + 0.08 * (12 + within(random));  // between the layers' centres
    const auto slice = by_blocks.interpolated(p, {}), exact = one_by_one.interpolated(p, {});
    ASSERT_LE(difference(oracle::matrix(slice), oracle::matrix(exact)), 1e-6) << "at " << p.transpose();
  }
}

// More layers than a word of heights has, and an edge so small that elements stand beyond one.
TEST(StoredField, EqualsTheExactFieldInATallRoomAndAtASmallEdge) {
  expect_exact_at_samples(scene::turned_room(0.4, 0.1, 17), 1000);
  expect_exact_at_samples(scene::turned_room(0.4, 0.035, 2.5), 200);
}

TEST(StoredField, HasTheSameBitsWithThePathsMadeAnewForEachBlock) {
  const OccupancyGrid grid = scene::small_room();
  const auto voxels = free_voxels(grid);
  std::vector<Variance> kept(grid.cell_count());
  const WholeField whole(grid, Model{}, voxels), anew(grid, Model{}, voxels, 0);
  whole.evaluate(0, whole.block_count(), [&](std::size_t n, const Variance& s) { kept[n] = s; });
  std::size_t count = 0;
  anew.evaluate(0, anew.block_count(), [&](std::size_t n, const Variance& s) {
    const Variance& t = kept[n];
    EXPECT_TRUE(s.xx == t.xx && s.xy == t.xy && s.yy == t.yy && s.zz == t.zz) << "voxel " << n;
    ++count;
  });
  EXPECT_EQ(count, voxels.size());
}

TEST(StoredField, EqualsTheExactFieldInARecordedBuilding) {
  const std::string file = BACKWASH_SOURCE_DIR "/tests/data/maps/geb079.bt";
  expect_exact_at_samples(*map::load_map(file), 2000);
}

TEST(StoredField, HasTheSameBitsHoweverTheBlocksAreDivided) {
  const OccupancyGrid grid = *map::builtin_scene("apartment", 0.1);
  auto voxels = free_voxels(grid);
  std::erase_if(voxels, [&](std::size_t n) { return grid.voxel(n).z() % 7 != 5; });
  const WholeField whole(grid, Model{}, voxels);
  const auto evaluate = [&](std::size_t step, bool backwards) {
    std::vector<Variance> sigma(grid.cell_count());
    for (std::size_t k = 0; k * step < whole.block_count(); ++k) {
      const std::size_t parts = (whole.block_count() + step - 1) / step, part = backwards ? parts - 1 - k : k;
      whole.evaluate(part * step, std::min((part + 1) * step, whole.block_count()),
                     [&](std::size_t n, const Variance& s) { sigma[n] = s; });
    }
    return sigma;
  };
  const auto at_once = evaluate(whole.block_count(), false);
  ASSERT_GT(whole.block_count(), 6u);
  for (const auto& [step, backwards] : {std::pair<std::size_t, bool>{1, false}, {1, true}, {3, true}, {7, false}}) {
    const auto divided = evaluate(step, backwards);
    for (const std::size_t n : voxels) {
      const Variance &s = divided[n], &t = at_once[n];
      ASSERT_TRUE(s.xx == t.xx && s.xy == t.xy && s.yy == t.yy && s.zz == t.zz) << "step " << step << ", voxel " << n;
    }
  }
}

/// Where a change reaches, Σ of that part of the map equals Σ of all of it in every bit; elsewhere the old one does.
void expect_update_equals_rebuild(const OccupancyGrid& before, const OccupancyGrid& after) {
  const auto store = [](DisturbanceField& field, const OccupancyGrid& grid, std::span<const std::size_t> voxels) {
    const WholeField whole(grid, Model{}, voxels);
    field.fill(whole, 0, whole.block_count());
  };
  DisturbanceField old(before, free_voxels(before)), rebuilt(after, free_voxels(after));
  store(old, before, free_voxels(before));
  store(rebuilt, after, free_voxels(after));
  const auto changed = test::changed_box(before, after);
  ASSERT_FALSE(changed.empty());
  const map::VoxelBox columns = affected_columns(after, Model{}, changed);
  const map::VoxelBox around = affected_columns(after, Model{}, columns);
  const OccupancyGrid part = map::part_of(after, around);
  std::vector<std::size_t> listed = free_voxels(part);
  std::erase_if(listed, [&](std::size_t n) { return !columns.contains(around.low + part.voxel(n)); });
  DisturbanceField anew(part, listed);
  store(anew, part, listed);
  std::size_t stored = 0, differ = 0;
  for (std::size_t n = 0; n < after.cell_count(); ++n) {
    const Index3 v = after.voxel(n);
    const bool reached = columns.contains(v);
    ASSERT_EQ(reached ? anew.has(v - around.low) : old.has(v), rebuilt.has(v)) << v.transpose();
    if (!rebuilt.has(v)) continue;
    const Variance s = reached ? anew.at(v - around.low) : old.at(v), t = rebuilt.at(v);
    ASSERT_TRUE(s.xx == t.xx && s.xy == t.xy && s.yy == t.yy && s.zz == t.zz) << v.transpose();
    ++stored;
    if (old.has(v)) differ += old.at(v).zz != t.zz;
  }
  EXPECT_GT(differ, 1000u);
  EXPECT_GT(stored, 10 * static_cast<std::size_t>(columns.high.z()));
}

TEST(StoredField, FollowsAChangeOfOneCubicMetreBitForBit) {
  const OccupancyGrid before = *map::builtin_scene("apartment", 0.1);
  for (const Vec3& corner : {Vec3(2.5, 3, 0), Vec3(0, 0, 0.5), Vec3(5.2, 5.1, 1.4)}) {
    OccupancyGrid after = before;
    for (std::size_t n = 0; n < after.cell_count(); ++n) {
      const Index3 v = after.voxel(n);
      const Vec3 in = after.center(v) - corner;
      if ((in.array() < 0).any() || (in.array() > 1).any()) continue;
      after.set(v, after.at(n) == Cell::free ? Cell::occupied : v.x() % 2 ? Cell::free : Cell::unknown);
    }
    expect_update_equals_rebuild(before, after);
  }
}

TEST(StoredField, StoresNothingForAnEmptyList) {
  const OccupancyGrid grid = scene::small_room();
  EXPECT_EQ(WholeField(grid, Model{}, {}).block_count(), 0u);
}

}  // namespace
}  // namespace backwash::field
