// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/scan/voxelise.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <random>

#include "core/map/free_space.hpp"
#include "core/map/lattice_box.hpp"

namespace backwash::map {
namespace {

/// What is left of a triangle after six half spaces were cut off: another way to ask whether it meets a cube.
std::vector<Vec3> clipped(const Triangle& triangle, const Vec3& center, double half) {
  std::vector<Vec3> polygon(triangle.begin(), triangle.end());
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      const auto inside = [&](const Vec3& p) { return half - sign * (p - center)[axis]; };
      std::vector<Vec3> kept;
      for (std::size_t n = 0; n < polygon.size(); ++n) {
        const Vec3 &p = polygon[n], &next = polygon[(n + 1) % polygon.size()];
        const double a = inside(p), b = inside(next);
        if (a >= 0) kept.push_back(p);
        if ((a >= 0) != (b >= 0)) kept.push_back(p + a / (a - b) * (next - p));
      }
      polygon = kept;
    }
  }
  return polygon;
}

/// As the cutting says; nothing where a millionth more or less would change it.
std::optional<bool> cut_meets(const Triangle& triangle, const Vec3& center, double half) {
  const bool more = !clipped(triangle, center, half + 1e-6).empty(),
             less = !clipped(triangle, center, half - 1e-6).empty();
  return more == less ? std::optional(more) : std::nullopt;
}

struct Draw {
  std::mt19937_64 random;
  double operator()(double low, double high) { return std::uniform_real_distribution(low, high)(random); }
  Vec3 point(double reach) { return {(*this)(-reach, reach), (*this)(-reach, reach), (*this)(-reach, reach)}; }
  /// Of every shape: small, large, slivers, and some flat along an axis.
  Triangle triangle(double reach) {
    const double size = std::pow(10, (*this)(-2, 0.5));
    const Vec3 first = point(reach);
    Triangle t = {first, first + size * point(1), first + size * point(1)};
    if ((*this)(0, 1) < 0.2) t[2] = t[0] + 0.4 * (t[1] - t[0]) + 1e-4 * point(1);
    if ((*this)(0, 1) < 0.2)
      for (auto& corner : t) corner.z() = first.z();
    return t;
  }
};

TEST(MeetsCube, SaysWhatCuttingTheTriangleBySixPlanesSays) {
  Draw draw{std::mt19937_64(3)};
  int met = 0, apart = 0;
  for (int n = 0; n < 200000; ++n) {
    const Triangle t = draw.triangle(1.5);
    const Vec3 center = draw.point(1);
    const double half = draw(0.1, 0.8);
    const auto expected = cut_meets(t, center, half);
    if (!expected) continue;
    ASSERT_EQ(meets_cube(t, center, half), *expected) << n;
    ++(*expected ? met : apart);
  }
  EXPECT_GT(met, 10000);
  EXPECT_GT(apart, 10000);
}

TEST(AddTriangle, OccupiesExactlyTheVoxelsThatItTouches) {
  Draw draw{std::mt19937_64(4)};
  int occupied = 0;
  for (int n = 0; n < 300; ++n) {
    OccupancyGrid grid({-0.7, -0.6, -0.5}, 0.1, {13, 12, 11});
    const Triangle t = draw.triangle(0.9);
    add_triangle(grid, t);
    for (std::size_t i = 0; i < grid.cell_count(); ++i) {
      const auto expected = cut_meets(t, grid.center(grid.voxel(i)), grid.resolution() * (0.5 + kOnFace));
      occupied += grid.at(i) == Cell::occupied;
      if (expected) {
        ASSERT_EQ(grid.at(i) == Cell::occupied, *expected) << n;
      }
    }
  }
  EXPECT_GT(occupied, 2000);
}

TEST(AddTriangle, OccupiesAShellOfACubeAndNothingInsideOfIt) {
  OccupancyGrid grid({0, 0, 0}, 0.1, {10, 10, 10});
  const auto corner = [](int n) { return Vec3(n & 1 ? 0.75 : 0.25, n & 2 ? 0.75 : 0.25, n & 4 ? 0.75 : 0.25); };
  for (const auto& [a, b, c, d] : std::vector<std::array<int, 4>>{
           {0, 1, 3, 2}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 3, 7, 5}}) {
    add_triangle(grid, {corner(a), corner(b), corner(c)});
    add_triangle(grid, {corner(a), corner(c), corner(d)});
  }
  EXPECT_EQ(std::ranges::count(grid.cells(), Cell::occupied), 6 * 6 * 6 - 4 * 4 * 4);
  EXPECT_EQ(std::ranges::count(grid.cells(), Cell::free), 0);
  EXPECT_EQ(grid.at({4, 4, 4}), Cell::unknown);
}

TEST(AddTriangle, MakesASlantedWallThatNoFloodPasses) {
  Draw draw{std::mt19937_64(5)};
  for (int n = 0; n < 40; ++n) {
    OccupancyGrid grid({0, 0, 0}, 0.1, {30, 30, 30});
    const Vec3 normal = draw.point(1).normalized(), middle = Vec3::Constant(1.5) + draw.point(0.3);
    const Vec3 along = 20 * normal.unitOrthogonal(), across = normal.cross(along);
    add_triangle(grid, {middle + along, middle - along + across, middle - along - across});
    const double off = normal.dot(Vec3::Constant(0.05) - middle);
    if (std::abs(off) < 0.2) continue;
    flood_free(grid, std::array{Index3(0, 0, 0)});
    for (std::size_t i = 0; i < grid.cell_count(); ++i) {
      const double distance = normal.dot(grid.center(grid.voxel(i)) - middle);
      if (grid.at(i) == Cell::free) {
        ASSERT_GT(distance * off, 0) << n;
      }
      if (grid.at(i) == Cell::occupied) {
        ASSERT_LE(std::abs(distance), 0.1 * std::sqrt(0.75) * 1.01);
      }
    }
  }
}

TEST(AddTriangle, TakesBothSidesOfAFaceItLiesOnAndSaysSo) {
  OccupancyGrid grid({0, 0, 0}, 0.1, {4, 4, 4});
  const Triangle on{Vec3(0.01, 0.01, 0.2f), Vec3(0.39, 0.01, 0.2f), Vec3(0.2, 0.39, 0.2f)};
  EXPECT_TRUE(on_faces(grid, on));
  add_triangle(grid, on);
  EXPECT_TRUE(grid.occupied({2, 1, 1}) && grid.occupied({2, 1, 2}));
  EXPECT_FALSE(grid.occupied({2, 1, 0}) || grid.occupied({2, 1, 3}));
  EXPECT_FALSE(on_faces(grid, {on[0], on[1], Vec3(0.2, 0.39, 0.21)}));
  EXPECT_FALSE(on_faces(grid, {Vec3(0, 0, 0.15), Vec3(0.3, 0, 0.15), Vec3(0, 0.3, 0.15)}));
}

TEST(AddPoints, OccupiesVoxelsWithEnoughPointsAndCountsThoseInside) {
  OccupancyGrid grid({0, 0, 0}, 0.5, {2, 2, 1});
  const std::vector<Vec3> points = {{0.1, 0.1, 0.1}, {0.5, 0.1, 0.1},  {0.6, 0.2, 0.3},
                                    {0.5, 0.5, 0},   {0.5, -0.001, 0}, {1.0, 0.1, 0.1}};
  EXPECT_EQ(add_points(grid, points, 2), 4u);
  EXPECT_EQ(std::ranges::count(grid.cells(), Cell::occupied), 1);
  EXPECT_TRUE(grid.occupied({1, 0, 0}));
  EXPECT_EQ(add_points(grid, points, 1), 4u);
  EXPECT_EQ(std::ranges::count(grid.cells(), Cell::occupied), 3);
}

}  // namespace
}  // namespace backwash::map
