// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "core/field/disturbance_field.hpp"
#include "core/field/proximity_model.hpp"
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

// Numbers in this file are worked out by hand from docs/model.md section 2 with the default model and a = 0.1.
constexpr double kEdge = 0.1;

Element up_at(const Vec3& c) { return {Element::Kind::up, c, Vec3::UnitZ(), 0.01, std::nullopt}; }
Element lateral_at(const Vec3& c, const Vec3& m, std::optional<Vec3> corner = std::nullopt) {
  return {Element::Kind::lateral, c, m, 0.01, corner};
}
double size(const Variance& v) { return std::abs(v.xx) + std::abs(v.yy) + std::abs(v.zz); }

TEST(GroundTerm, HasItsClosedFormStraightAbove) {
  const ProximityModel terms(Model{}, kEdge);
  const Variance s = terms.ground(up_at({3, -2, 0.5}), {3, -2, 1.5});
  EXPECT_NEAR(s.xx, 0.01 * (0.010 + 0.05 * 0.049787068), 1e-12);  // exp(−3) = 0.049787068
  EXPECT_NEAR(s.zz, 0.01 * (0.020 + 0.12 * 0.049787068), 1e-12);
  EXPECT_EQ(s.xx, s.yy);
  EXPECT_EQ(s.xy, 0);
  EXPECT_EQ(s.xz, 0);
  EXPECT_EQ(s.yz, 0);
}

TEST(GroundTerm, StopsGrowingAtHalfAVoxel) {
  const ProximityModel terms(Model{}, kEdge);
  const Variance s = terms.ground(up_at({0, 0, 0}), {0, 0, 0});
  EXPECT_NEAR(s.zz, 0.01 * (0.020 * 400 + 0.12 * 0.992528055), 1e-9);  // l = 0.05, exp(−0.0075)
  EXPECT_EQ(terms.ground(up_at({0, 0, 0}), {0, 0, 0.04}).zz, s.zz);
}

TEST(GroundTerm, GatesAreWhereTheModelPutsThem) {
  const ProximityModel terms(Model{}, kEdge);
  const Element e = up_at({0, 0, 0});
  EXPECT_GT(size(terms.ground(e, {0.870, 0, 0.5})), 0);  // tan θ̄_g = tan 1.05 = 1.7433
  EXPECT_EQ(size(terms.ground(e, {0.873, 0, 0.5})), 0);
  EXPECT_GT(size(terms.ground(e, {0.5, 0, 1.936})), 0);  // l̄_g = 2: √(4 − 0.25) = 1.93649
  EXPECT_EQ(size(terms.ground(e, {0.5, 0, 1.937})), 0);
  EXPECT_GT(size(terms.ground(e, {0.1799, 0, 3})), 0);  // the footprint, r0 = 0.18, reaches to l̄_u = 4
  EXPECT_EQ(size(terms.ground(e, {0.1801, 0, 3})), 0);
  EXPECT_GT(size(terms.ground(e, {0, 0, 3.999})), 0);
  EXPECT_EQ(size(terms.ground(e, {0, 0, 4.001})), 0);
  EXPECT_GT(size(terms.ground(e, {0.17, 0, 0.01})), 0);   // outside the cone, in the footprint
  EXPECT_EQ(size(terms.ground(e, {0.17, 0, -0.01})), 0);  // θ > π/2
}

TEST(WallTerm, HasItsClosedFormBesideAWallThatFacesAnyWay) {
  const ProximityModel terms(Model{}, kEdge);
  const Vec3 m(0.6, 0.8, 0), t(-0.8, 0.6, 0);
  const Variance s = terms.wall(lateral_at({0, 0, 1}, m), m + Vec3(0, 0, 1));
  constexpr double kDecay = 0.082084999;  // exp(−2.5)
  EXPECT_NEAR(s.along(m), 0.01 * 0.25 * kDecay, 1e-12);
  EXPECT_NEAR(s.along(t), 0.01 * 0.10 * kDecay, 1e-12);
  EXPECT_NEAR(s.along(Vec3::UnitZ()), 0.01 * 0.12 * kDecay, 1e-12);
  EXPECT_NEAR(s.xy, 0.01 * 0.15 * 0.48 * kDecay, 1e-12);  // (s_n − s_t) m_x m_y
}

TEST(WallTerm, GatesAreWhereTheModelPutsThemAndLevelCounts) {
  const ProximityModel terms(Model{}, kEdge);
  const Element e = lateral_at({0, 0, 0}, Vec3::UnitX());
  EXPECT_GT(size(terms.wall(e, {1, 0, 0})), 0);
  EXPECT_GT(size(terms.wall(lateral_at({0.1 * 3, 0, 0.1 * 3}, Vec3::UnitX()), {1, 0, 0.3})), 0);  // 0.1·3 > 0.3
  EXPECT_EQ(size(terms.wall(e, {1, 0, -0.001})), 0);
  EXPECT_GT(size(terms.wall(e, {0.5, 0, 0.396})), 0);  // θ_w = 0.9: 0.5/tan 0.9 = 0.39678
  EXPECT_EQ(size(terms.wall(e, {0.5, 0, 0.397})), 0);
  EXPECT_GT(size(terms.wall(e, {1.5, 0, 0})), 0);
  EXPECT_EQ(size(terms.wall(e, {1.5001, 0, 0})), 0);
}

TEST(CornerTerm, HasItsClosedForm) {
  const ProximityModel terms(Model{}, kEdge);
  const Vec3 m(0, -1, 0);
  // d_c = 0.4, h_c = 0.5: φ = atan 0.8 = 0.674740942, d_c² + h_c⁶ = 0.16 + 0.015625
  const Variance s = terms.corner(lateral_at({0, 0, 0.9}, m, Vec3(0, 0, 0)), {0.24, -0.32, 0.5});
  const double common = 0.01 * (1.2 - 0.674740942) / 0.175625;
  EXPECT_NEAR(s.yy, 0.02 * common, 1e-10);
  EXPECT_NEAR(s.xx, 0.012 * common, 1e-10);
  EXPECT_NEAR(s.zz, 0.02 * common, 1e-10);
}

TEST(CornerTerm, GatesAreWhereTheModelPutsThem) {
  const ProximityModel terms(Model{}, kEdge);
  const auto at = [&](double c_z, double d, double h) {
    return size(terms.corner(lateral_at({0, 0, c_z}, Vec3::UnitX(), Vec3(0, 0, 0)), {d, 0, h}));
  };
  EXPECT_GT(at(0.5, 0.51, 0.2), 0);  // tan φ̄_c = tan 1.2 = 2.5722
  EXPECT_EQ(at(0.5, 0.52, 0.2), 0);
  EXPECT_EQ(at(0.5, 0.2 * std::tan(1.2) * 1.00002, 0.2), 0);  // a hair outside the cone, where φ̄_c − φ is negative
  EXPECT_EQ(at(0.5, 0.3, 0), 0);                              // level with the corner: φ = π/2
  EXPECT_EQ(at(0.5, 0.3, -0.2), 0);
  EXPECT_GT(at(0.5, 0.9, 1.199), 0);  // l̄_c = 1.5
  EXPECT_EQ(at(0.5, 0.9, 1.201), 0);
  EXPECT_GT(at(1.699, 0.9, 0.5), 0);  // |r| ≤ l̄_w = 1.5 for the element itself
  EXPECT_EQ(at(1.701, 0.9, 0.5), 0);
  EXPECT_EQ(size(terms.corner(lateral_at({0, 0, 0.5}, Vec3::UnitX()), {0.3, 0, 0.5})), 0);
}

TEST(Terms, AreFiniteEverywhereIncludingTheElementsThemselves) {
  const ProximityModel terms(Model{}, kEdge);
  const Element up = up_at({1, 1, 1}), lateral = lateral_at({1, 1, 1}, Vec3::UnitX(), Vec3(1, 1, 1));
  for (const Vec3& p : {Vec3(1, 1, 1), Vec3(1, 1, 1 + 1e-300), Vec3(1 + 1e-12, 1, 1), Vec3(1, 1, 1.001)})
    for (const Variance& s : {terms.ground(up, p), terms.corner(lateral, p), terms.wall(lateral, p)})
      for (const double x : {s.xx, s.xy, s.xz, s.yy, s.yz, s.zz}) EXPECT_TRUE(std::isfinite(x)) << p.transpose();
}

TEST(Terms, AreZeroForTheOtherKindOfElement) {
  const ProximityModel terms(Model{}, kEdge);
  EXPECT_EQ(size(terms.wall(up_at({0, 0, 0}), {0.5, 0, 0.1})), 0);
  EXPECT_EQ(size(terms.corner(up_at({0, 0, 0}), {0.5, 0, 0.5})), 0);
  EXPECT_EQ(size(terms.ground(lateral_at({0, 0, 0}, Vec3::UnitX(), Vec3(0, 0, -0.5)), {0.1, 0, 0.5})), 0);
}

}  // namespace
}  // namespace backwash::field
