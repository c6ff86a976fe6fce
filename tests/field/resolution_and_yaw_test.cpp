// SPDX-License-Identifier: BSD-3-Clause
// What the elements of docs/model.md section 1 are for: a wall's Σ must not depend on how the voxels happen to lie.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <array>
#include <numbers>
#include <string>

#include "core/field/disturbance_field.hpp"
#include "tests/field/scenes.hpp"

namespace backwash::field {
namespace {

using map::Cell;
using map::OccupancyGrid;

const Vec3 kOn(2.5, 2.5, 0);  // a corner of voxels at 0.1 and 0.05 m

/// A thick wall behind the vertical plane through `on`, n pointing into it, on a floor at z = 0.1.
struct WallScene {
  OccupancyGrid grid;
  ProximityField exact;
  WallScene(double a, const Vec3& on, const Vec3& n) : grid(rasterised(a, on, n)), exact(grid, Model{}) {}

  static OccupancyGrid rasterised(double a, const Vec3& on, const Vec3& n) {
    OccupancyGrid g(Vec3::Zero(), a, (Vec3(5, 5, 2.5) / a).array().round().cast<int>(), Cell::free);
    // At 45° the plane runs through voxel centres: rounding must not make the wall rough.
    scene::paint(g, Cell::occupied, [&](const Vec3& x) { return n.dot(x - on) > 1e-6 || x.z() < 0.1; });
    return g;
  }
};

struct Parts {
  Vec3 wall = Vec3::Zero(), corner = Vec3::Zero();  // normal, tangential, vertical
};
/// Wall and corner parts in the wall's axes, at a distance from the plane, a shift along it and a height.
Parts parts(const WallScene& scene, const Vec3& on, const Vec3& n, double distance, double along, double z) {
  const Vec3 t = Vec3::UnitZ().cross(n);
  const Breakdown b = scene.exact.at(on - distance * n + along * t + Vec3(0, 0, z));
  const auto axes = [&](const Variance& v) { return Vec3(v.along(n), v.along(t), v.zz); };
  return {axes(b.wall), axes(b.corner)};
}

void expect_within_ten_percent(const Vec3& actual, const Vec3& expected, const std::string& where) {
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(actual[axis], expected[axis], 0.1 * expected[axis]) << where;
}

std::string where(int degrees, int voxels, double z) {
  return std::to_string(degrees) + " deg, " + std::to_string(voxels) + " voxels, z " + std::to_string(z);
}

// Single points: 10 % holds beside the grid's corner kOn (and at all but 3 of 2,970 points along the wall, where the
// gates take or leave a few elements: 10.9 % at worst).
TEST(Yaw, ChangesTheWallTermByLessThanTenPercentAtAPointAndInTheMeanAlongTheWall) {
  const WallScene straight(0.1, kOn, Vec3::UnitX());
  for (int degrees = 3; degrees <= 45; degrees += 3) {
    const double yaw = degrees * std::numbers::pi / 180;
    const Vec3 n(std::cos(yaw), std::sin(yaw), 0);
    const WallScene turned(0.1, kOn, n);
    for (int voxels = 3; voxels <= 8; ++voxels)
      for (const double z : {0.55, 0.8, 1.2}) {
        Parts expected, actual;
        for (int shift : {0, -5, -4, -3, -2, -1, 1, 2, 3, 4, 5}) {
          const Parts e = parts(straight, kOn, Vec3::UnitX(), 0.1 * voxels, 0.05 * shift, z);
          const Parts a = parts(turned, kOn, n, 0.1 * voxels, 0.05 * shift, z);
          if (shift == 0) expect_within_ten_percent(a.wall, e.wall, "at a point, " + where(degrees, voxels, z));
          if (z == 0.8) expect_within_ten_percent(a.corner, e.corner, "corner, " + where(degrees, voxels, z));
          expected.wall += e.wall;
          actual.wall += a.wall;
        }
        expect_within_ten_percent(actual.wall, expected.wall, "in the mean, " + where(degrees, voxels, z));
      }
  }
}

// The corner term goes with 1/d_c²: at 3 voxels a rasterised wall that stands a third of a voxel before its plane gives
// 13 % more, whatever the formula. So over all heights it is held to 10 % in the mean over where the plane lies in the
// grid and where the vehicle is along it (single points: 15 % at worst).
TEST(Yaw, ChangesTheCornerTermByLessThanTenPercentInTheMeanOverTheGridsPhase) {
  constexpr std::array kHeights{0.55, 0.8, 1.2};
  constexpr int kPhases = 5;
  using Sums = std::array<std::array<Vec3, 6>, 3>;  // of the corner term, [height][distance]
  const auto add_along = [&](Sums& sums, const WallScene& scene, const Vec3& on, const Vec3& n, double weight) {
    for (std::size_t h = 0; h < 3; ++h)
      for (std::size_t v = 0; v < 6; ++v)
        for (int shift = -3; shift <= 3; ++shift)
          sums[h][v] +=
              weight * parts(scene, on, n, 0.1 * (3.0 + static_cast<double>(v)), 0.08 * shift, kHeights[h]).corner;
  };
  Sums zero;
  for (auto& row : zero) row.fill(Vec3::Zero());
  Sums expected = zero;
  add_along(expected, WallScene(0.1, kOn, Vec3::UnitX()), kOn, Vec3::UnitX(), kPhases);
  for (int degrees = 9; degrees <= 45; degrees += 9) {
    const double yaw = degrees * std::numbers::pi / 180;
    const Vec3 n(std::cos(yaw), std::sin(yaw), 0);
    Sums actual = zero;
    for (int phase = 0; phase < kPhases; ++phase) {
      const Vec3 on = kOn + 0.02 * (phase - 2) * n;
      add_along(actual, WallScene(0.1, on, n), on, n, 1);
    }
    for (std::size_t h = 0; h < 3; ++h)
      for (std::size_t v = 0; v < 6; ++v)
        expect_within_ten_percent(actual[h][v], expected[h][v], where(degrees, 3 + static_cast<int>(v), kHeights[h]));
  }
}

TEST(Halving, ChangesSigmaByLessThanTenPercentOverAFlatFloor) {
  const WallScene coarse(0.1, kOn, Vec3::UnitX()), fine(0.05, kOn, Vec3::UnitX());
  for (int shift = 0; shift <= 8; ++shift)
    for (const double l : {0.3, 0.42, 0.65, 1.1}) {
      const Vec3 p(0.9 + 0.0125 * shift, 2.5 + 0.00625 * shift, 0.1 + l);  // 1.5 m and more from the wall: out of range
      const Variance actual = coarse.exact.at(p).sigma(), expected = fine.exact.at(p).sigma();
      EXPECT_GT(expected.zz, 2 * Model{}.base.vertical);
      expect_within_ten_percent({actual.xx, actual.yy, actual.zz}, {expected.xx, expected.yy, expected.zz},
                                "l " + std::to_string(l) + ", shift " + std::to_string(shift));
    }
}

// The gate θ ≤ π/2 takes or leaves a whole row of voxels, so Σ beside a wall is a saw-tooth in the height of p with the
// period a: at 0.3 m the two resolutions differ by 16 % of the wall term (11 % of Σ) at the worst heights, by less than
// 1 % at the heights of voxel faces and in the mean over one period.
TEST(Halving, ChangesSigmaByLessThanTenPercentBesideAFlatWallAtFaceHeightsAndInTheMean) {
  const WallScene coarse(0.1, kOn, Vec3::UnitX()), fine(0.05, kOn, Vec3::UnitX());
  for (const double l : {0.3, 0.42, 0.65, 1.1}) {
    Vec3 actual_mean = Vec3::Zero(), expected_mean = Vec3::Zero();
    for (int step = 0; step < 16; ++step) {
      const double z = 1.3 + 0.1 * step / 16 + 0.001;
      const Vec3 p = kOn + Vec3(-l, 0.013 * step, z);
      const Variance actual = coarse.exact.at(p).sigma(), expected = fine.exact.at(p).sigma();
      EXPECT_GT(fine.exact.at(p).wall.xx, 0);
      actual_mean += Vec3(actual.xx, actual.yy, actual.zz);
      expected_mean += Vec3(expected.xx, expected.yy, expected.zz);
      if (step == 0) expect_within_ten_percent(actual_mean, expected_mean, "l " + std::to_string(l));
    }
    expect_within_ten_percent(actual_mean, expected_mean, "mean, l " + std::to_string(l));
  }
}

}  // namespace
}  // namespace backwash::field
