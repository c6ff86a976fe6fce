// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "core/field/disturbance_field.hpp"
#include "core/map/load_map.hpp"
#include "tests/field/brute_force.hpp"
#include "tests/field/scenes.hpp"

namespace backwash::field {
namespace {

using map::Cell;
using map::OccupancyGrid;

void expect_close(const Variance& actual, const Mat3& expected, const Vec3& p, const char* part) {
  EXPECT_LE((oracle::matrix(actual) - expected).cwiseAbs().maxCoeff(), 1e-9 * expected.cwiseAbs().maxCoeff())
      << part << " at " << p.transpose();
}

/// Compares every part at the points; returns how many points had a non-zero (ground, corner, wall).
Index3 compare(const OccupancyGrid& grid, const Model& model, const std::vector<Vec3>& points) {
  const ProximityField exact(grid, model);
  const auto elements = oracle::pieces(grid);
  const auto occupied = oracle::occupied_centers(grid);
  Index3 nonzero(0, 0, 0);
  for (const Vec3& p : points) {
    const Breakdown b = exact.at(p);
    const oracle::Parts expected = oracle::evaluate(grid, elements, occupied, model, p);
    expect_close(b.ground, expected.ground, p, "ground");
    expect_close(b.corner, expected.corner, p, "corner");
    expect_close(b.wall, expected.wall, p, "wall");
    const Mat3 base = Vec3(model.base.horizontal, model.base.horizontal, model.base.vertical).asDiagonal();
    expect_close(b.base, base, p, "base");
    expect_close(b.sigma(), base + expected.ground + expected.corner + expected.wall, p, "sum");
    nonzero += Index3(!expected.ground.isZero(0), !expected.corner.isZero(0), !expected.wall.isZero(0));
  }
  return nonzero;
}

/// Points of a grid: anywhere, voxel centres, and the lattice of half voxels where ties are.
std::vector<Vec3> some_points(const OccupancyGrid& grid, unsigned seed, int count) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(-0.05, 1.05);
  std::vector<Vec3> points;
  for (int n = 0; n < count; ++n) {
    const Vec3 x = Vec3(u(random), u(random), u(random)).cwiseProduct(grid.size().cast<double>());
    const Vec3 snapped = n % 3 == 0   ? x
                         : n % 3 == 1 ? Vec3(x.array().floor() + 0.5)
                                      : Vec3((2 * x).array().floor() / 2);
    points.push_back(grid.origin() + grid.resolution() * snapped);
  }
  return points;
}

TEST(ProximityField, EqualsBruteForceOnRandomMaps) {
  Index3 nonzero(0, 0, 0);
  for (unsigned seed = 0; seed < 24; ++seed) {
    const OccupancyGrid grid = scene::random_map(seed, seed % 2 ? 0.1 : 0.17);
    nonzero += compare(grid, Model{}, some_points(grid, seed, 30));
  }
  EXPECT_GT(nonzero.minCoeff(), 200);
}

TEST(ProximityField, EqualsBruteForceWithOtherGates) {
  Model model;
  model.ground.theta_max = 0.6;
  model.ground.l_max = 0.5;
  model.ground.r0 = 0.3;
  model.ground.l_footprint_max = 0.9;
  model.corner.phi_max = 1.8;
  model.corner.l_max = 2.5;
  model.wall.theta_min = 0;
  model.wall.l_max = 0.8;
  Index3 nonzero(0, 0, 0);
  for (unsigned seed = 100; seed < 108; ++seed) {
    const OccupancyGrid grid = scene::random_map(seed, 0.1);
    nonzero += compare(grid, model, some_points(grid, seed, 30));
  }
  EXPECT_GT(nonzero.minCoeff(), 50);
}

TEST(ProximityField, EqualsBruteForceInAFurnishedRoom) {
  const OccupancyGrid grid = scene::small_room();
  EXPECT_GT(compare(grid, Model{}, some_points(grid, 5, 60)).minCoeff(), 20);
}

/// The part of a map that the default model can see from p, with room for normals and corners.
OccupancyGrid around(const OccupancyGrid& grid, const Vec3& p) {
  const Index3 low = grid.index(p - Vec3(2.5, 2.5, 4.5)).cwiseMax(0);
  const Index3 high = grid.index(p + Vec3(2.5, 2.5, 2.5)).cwiseMin(grid.size() - Index3::Ones());
  OccupancyGrid part(grid.origin() + grid.resolution() * low.cast<double>(), grid.resolution(),
                     high - low + Index3::Ones());
  for (std::size_t n = 0; n < part.cell_count(); ++n) part.set(part.voxel(n), grid.at(Index3(part.voxel(n) + low)));
  return part;
}

TEST(ProximityField, EqualsBruteForceInARecordedBuilding) {
  const std::string path = BACKWASH_SOURCE_DIR "/tests/data/maps/geb079.bt";
  const auto grid = map::load_octomap(path);
  ASSERT_TRUE(grid) << grid.error().message;
  const ProximityField exact(*grid, Model{});
  std::mt19937 random(3);
  std::uniform_int_distribution<std::size_t> draw(0, grid->cell_count() - 1);
  Index3 nonzero(0, 0, 0);
  for (int n = 0; n < 8;) {
    const std::size_t voxel = draw(random);
    if (grid->at(voxel) != Cell::free) continue;
    ++n;
    const Vec3 p = grid->center(grid->voxel(voxel));
    const OccupancyGrid part = around(*grid, p);
    const auto expected = oracle::evaluate(part, oracle::pieces(part), oracle::occupied_centers(part), Model{}, p);
    const Breakdown b = exact.at(p);
    // Coordinates are sums from two origins: the same point differs by rounding.
    expect_close(b.ground, expected.ground, p, "ground");
    expect_close(b.corner, expected.corner, p, "corner");
    expect_close(b.wall, expected.wall, p, "wall");
    nonzero += Index3(!expected.ground.isZero(0), !expected.corner.isZero(0), !expected.wall.isZero(0));
  }
  EXPECT_GT(nonzero.minCoeff(), 0);
}

TEST(ProximityField, IsTheBaseFarFromEverything) {
  const OccupancyGrid grid(Vec3::Zero(), 0.1, Index3(40, 40, 40), Cell::free);
  const ProximityField exact(grid, Model{});
  for (const Vec3& p : {Vec3(2, 2, 2), Vec3(1e9, -1e9, 1e9)}) {
    EXPECT_EQ(exact.at(p).sigma().xx, Model{}.base.horizontal);
    EXPECT_EQ(exact.at(p).sigma().yy, Model{}.base.horizontal);
    EXPECT_EQ(exact.at(p).sigma().zz, Model{}.base.vertical);
  }
}

TEST(ProximityField, UnknownNeitherEmitsNorBlocks) {
  const Vec3 p(1.05, 1.05, 1.55);
  OccupancyGrid free(Vec3::Zero(), 0.1, Index3(21, 21, 21), Cell::free);
  scene::paint(free, Cell::occupied, [](const Vec3& x) { return x.z() < 0.1; });
  OccupancyGrid unknown = free;  // a slab of unknown space half-way down
  scene::paint(unknown, Cell::unknown, [](const Vec3& x) { return x.z() > 0.8 && x.z() < 1.1; });
  const double expected = ProximityField(free, Model{}).at(p).sigma().zz;
  EXPECT_GT(expected, Model{}.base.vertical);
  EXPECT_EQ(ProximityField(unknown, Model{}).at(p).sigma().zz, expected);

  OccupancyGrid shut = free;
  scene::paint(shut, Cell::occupied, [](const Vec3& x) { return x.z() > 0.8 && x.z() < 1.1; });
  const double lid_only = ProximityField(shut, Model{}).at(p).ground.zz;
  scene::paint(shut, Cell::free, [](const Vec3& x) { return x.z() < 0.1; });
  EXPECT_EQ(ProximityField(shut, Model{}).at(p).ground.zz, lid_only);  // nothing of the floor came through
}

TEST(ProximityField, DoesNotSeeAnElementFromItsOwnPlane) {
  OccupancyGrid grid(Vec3::Zero(), 0.1, Index3(21, 21, 21), Cell::free);
  scene::paint(grid, Cell::occupied, [](const Vec3& x) { return x.z() < 0.3; });
  const ProximityField exact(grid, Model{});
  EXPECT_EQ(exact.at(Vec3(1.05, 1.05, 0.1 * 3)).ground.zz, 0);
  EXPECT_EQ(exact.at(Vec3(1.05, 1.05, 0.3)).ground.zz, 0);
  EXPECT_GT(exact.at(Vec3(1.05, 1.05, 0.301)).ground.zz, 0);
}

}  // namespace
}  // namespace backwash::field
