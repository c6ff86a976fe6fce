// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/clearance.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace backwash::reach {
namespace {

using Vec2 = Eigen::Vector2d;
const double kSqrt2 = std::sqrt(2.0);

// Oracle: polygons as point sets, no supports and no Minkowski sum. ------------------------------------------------

struct Line {
  Vec2 n;
  double limit;  // n·x ≤ limit
};

bool satisfies(const std::vector<Line>& lines, const Vec2& x) {
  return std::all_of(lines.begin(), lines.end(), [&](const Line& l) { return l.n.dot(x) <= l.limit + 1e-9; });
}

std::vector<Line> octagon(const PerDirection& h) {
  std::vector<Line> lines;
  for (const Direction d : {kX, kY, kXyPlus, kXyMinus}) {
    lines.push_back({unit(d).head<2>(), h[d]});
    lines.push_back({-unit(d).head<2>(), h[d]});
  }
  return lines;
}

/// Every intersection of two boundary lines that satisfies all others.
std::vector<Vec2> corners(const std::vector<Line>& lines) {
  std::vector<Vec2> found;
  for (const Line& a : lines) {
    for (const Line& b : lines) {
      Eigen::Matrix2d M;
      M << a.n.transpose(), b.n.transpose();
      if (std::abs(M.determinant()) < 1e-6) continue;
      const Vec2 x = M.inverse() * Vec2(a.limit, b.limit);
      const bool known = std::any_of(found.begin(), found.end(), [&](const Vec2& f) { return (f - x).norm() < 1e-9; });
      if (!known && satisfies(lines, x)) found.push_back(x);
    }
  }
  return found;
}

double point_to_segment(const Vec2& p, const Vec2& a, const Vec2& b) {
  const double length2 = (b - a).squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(b - a) / length2, 0.0, 1.0) : 0.0;
  return (p - a - t * (b - a)).norm();
}

double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }

double segment_to_segment(const Vec2& a, const Vec2& b, const Vec2& c, const Vec2& d) {
  const bool split_ab = cross(b - a, c - a) * cross(b - a, d - a) < 0;
  const bool split_cd = cross(d - c, a - c) * cross(d - c, b - c) < 0;
  if (split_ab && split_cd) return 0;
  return std::min(
      {point_to_segment(a, c, d), point_to_segment(b, c, d), point_to_segment(c, a, b), point_to_segment(d, a, b)});
}

/// Convex polygons, corners in any order: chords lie inside, so all pairs of corners may stand in for the edges.
double polygon_to_square(const std::vector<Vec2>& polygon, const std::vector<Line>& lines, const Vec2& low, double a) {
  const std::vector<Vec2> square{low, low + Vec2(a, 0), low + Vec2(a, a), low + Vec2(0, a)};
  const Vec2 middle = low + Vec2(a, a) / 2;
  if (satisfies(lines, middle) || middle.cwiseAbs().maxCoeff() <= a / 2) return 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    for (std::size_t j = i; j < polygon.size(); ++j) {
      for (std::size_t k = 0; k < 4; ++k) {
        nearest = std::min(nearest, segment_to_segment(polygon[i], polygon[j], square[k], square[(k + 1) % 4]));
      }
    }
  }
  return nearest;
}

/// All voxels, and one layer around the grid for what is outside it.
double brute_force(const map::OccupancyGrid& grid, const Vec3& center, const PerDirection& h, double limit) {
  const std::vector<Line> lines = octagon(h);
  const std::vector<Vec2> polygon = corners(lines);
  const double a = grid.resolution();
  double nearest = limit;
  for (int k = -1; k <= grid.size().z(); ++k) {
    for (int j = -1; j <= grid.size().y(); ++j) {
      for (int i = -1; i <= grid.size().x(); ++i) {
        const Index3 v(i, j, k);
        if (grid.free(v)) continue;
        const Vec3 low = grid.origin() + a * v.cast<double>() - center;
        const double gap_z = std::max({0.0, low.z() - h[kZ], -h[kZ] - low.z() - a});
        if (gap_z >= nearest) continue;
        nearest = std::min(nearest, std::hypot(gap_z, polygon_to_square(polygon, lines, low.head<2>(), a)));
      }
    }
  }
  return nearest;
}

// Scenes ------------------------------------------------------------------------------------------------------------

constexpr double kFar = std::numeric_limits<double>::max();

map::OccupancyGrid random_grid(std::mt19937& random, double density) {
  map::OccupancyGrid grid(Vec3(-0.7, 0.3, 1.1), 0.1, Index3(19, 16, 13), map::Cell::free);
  std::bernoulli_distribution obstacle(density), unknown(0.3);
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    if (obstacle(random)) grid.set(grid.voxel(n), unknown(random) ? map::Cell::unknown : map::Cell::occupied);
  }
  return grid;
}

Vec3 random_point(std::mt19937& random, const map::OccupancyGrid& grid) {
  std::uniform_real_distribution<double> u(0.02, 0.98);
  return grid.origin() + 0.1 * grid.size().cast<double>().cwiseProduct(Vec3(u(random), u(random), u(random)));
}

/// Half widths in any proportion: either pair of slabs may be idle, and the octagon may lean.
PerDirection random_half_widths(std::mt19937& random) {
  std::uniform_real_distribution<double> u(0.0, 0.3);
  PerDirection h;
  for (double& value : h) value = u(random);
  return h;
}

/// An empty room of 8 m with one occupied voxel of 0.1 m whose lowest corner is `low`.
map::OccupancyGrid one_voxel(const Vec3& low) {
  map::OccupancyGrid grid(Vec3(-4, -4, -4), 0.1, Index3(80, 80, 80), map::Cell::free);
  grid.set(grid.index(low + Vec3::Constant(0.05)), map::Cell::occupied);
  return grid;
}

// Claims ------------------------------------------------------------------------------------------------------------

TEST(PrismDistance, EqualsBruteForceOnRandomGrids) {
  std::mt19937 random(5);
  int apart = 0;
  for (const double density : {0.0, 0.002, 0.01, 0.05}) {
    for (int trial = 0; trial < 60; ++trial) {
      const map::OccupancyGrid grid = random_grid(random, density);
      const Vec3 p = random_point(random, grid);
      const PerDirection h = random_half_widths(random);
      const double expected = brute_force(grid, p, h, 0.6);
      EXPECT_NEAR(prism_distance(grid, p, h, 0.6), expected, 1e-9);
      const map::OccupancySums sums(grid);
      EXPECT_EQ(prism_distance(grid, p, h, 0.6, &sums), prism_distance(grid, p, h, 0.6));
      apart += expected > 0 && expected < 0.6;
    }
  }
  EXPECT_GT(apart, 80);  // neither touching nor out of range: the comparison means something
}

TEST(PrismDistance, ToSolidBlocksEqualsBruteForce) {
  std::mt19937 random(10);
  std::uniform_int_distribution<int> low(-4, 18), length(2, 7);
  int apart = 0;
  for (int trial = 0; trial < 150; ++trial) {
    map::OccupancyGrid grid = random_grid(random, 0.0);
    for (int block = 0; block < 2; ++block) {
      const Index3 corner(low(random), low(random), low(random));
      const Index3 size(length(random), length(random), length(random));
      for (std::size_t n = 0; n < grid.cell_count(); ++n) {
        const Index3 offset = grid.voxel(n) - corner;
        if ((offset.array() >= 0).all() && (offset.array() < size.array()).all()) {
          grid.set(grid.voxel(n), map::Cell::occupied);
        }
      }
    }
    const Vec3 p = random_point(random, grid);
    const PerDirection h = random_half_widths(random);
    const double expected = brute_force(grid, p, h, 0.6);
    EXPECT_NEAR(prism_distance(grid, p, h, 0.6), expected, 1e-9);
    const map::OccupancySums sums(grid);
    EXPECT_EQ(prism_distance(grid, p, h, 0.6, &sums), prism_distance(grid, p, h, 0.6));
    apart += expected > 0 && expected < 0.6;
  }
  EXPECT_GT(apart, 50);
}

TEST(PrismDistance, OfAPointIsTheDistanceToTheNearestBox) {
  std::mt19937 random(6);
  const map::OccupancyGrid grid = random_grid(random, 0.005);
  for (int trial = 0; trial < 200; ++trial) {
    const Vec3 p = random_point(random, grid);
    double expected = ((p - grid.origin()).cwiseMin(grid.origin() + Vec3(1.9, 1.6, 1.3) - p)).minCoeff();
    for (std::size_t n = 0; n < grid.cell_count(); ++n) {
      if (grid.at(n) == map::Cell::free) continue;
      const Vec3 gap = (p - grid.center(grid.voxel(n))).cwiseAbs() - Vec3::Constant(0.05);
      expected = std::min(expected, gap.cwiseMax(0.0).norm());
    }
    EXPECT_NEAR(prism_distance(grid, p, PerDirection{}, kFar), std::max(0.0, expected), 1e-9);
  }
}

TEST(PrismDistance, OfABoxIsTheGapBetweenBoxes) {
  const map::OccupancyGrid grid = one_voxel(Vec3(1.0, 1.2, 0.9));
  const PerDirection box{0.2, 0.3, 0.1, 10.0, 10.0};  // idle diagonals
  EXPECT_NEAR(prism_distance(grid, Vec3::Zero(), box, kFar), Vec3(0.8, 0.9, 0.8).norm(), 1e-9);
}

TEST(PrismDistance, OfADiamondIsTakenFromItsTipAndFromItsSide) {
  const PerDirection diamond{10.0, 10.0, 0.1, 0.2, 0.2};  // idle axes; tips at 0.2 √2
  EXPECT_NEAR(prism_distance(one_voxel(Vec3(1.0, 0.0, 0.0)), Vec3(0, 0.05, 0.05), diamond, kFar), 1.0 - 0.2 * kSqrt2,
              1e-9);
  EXPECT_NEAR(prism_distance(one_voxel(Vec3(1.0, 1.0, 0.0)), Vec3(0, 0, 0.05), diamond, kFar), kSqrt2 - 0.2, 1e-9);
  EXPECT_NEAR(prism_distance(one_voxel(Vec3(1.0, -1.1, 0.0)), Vec3(0, 0, 0.05), diamond, kFar), kSqrt2 - 0.2, 1e-9);
}

TEST(PrismDistance, OfASliverAlongADiagonalEndsWhereTheAxesCutIt) {
  const PerDirection sliver{0.3, 0.5, 0.1, 10.0, 0.0};  // the segment from (−0.3, −0.3) to (0.3, 0.3)
  EXPECT_NEAR(prism_distance(one_voxel(Vec3(1.0, 1.0, 0.0)), Vec3(0, 0, 0.05), sliver, kFar), 0.7 * kSqrt2, 1e-9);
  EXPECT_NEAR(prism_distance(one_voxel(Vec3(0.5, -0.6, 0.0)), Vec3(0, 0, 0.05), sliver, kFar), 0.5 * kSqrt2, 1e-9);
}

TEST(PrismDistance, ToABarIsTheGapToItsNearEndInEveryDirection) {
  const PerDirection h{0.2, 0.2, 0.2, 10.0, 10.0};
  for (const int axis : {0, 1, 2}) {
    for (const int sign : {1, -1}) {
      map::OccupancyGrid grid(Vec3(-4, -4, -4), 0.1, Index3(80, 80, 80), map::Cell::free);
      for (int n = 0; n < 20; ++n) {
        Vec3 p = Vec3::Constant(0.05);
        p[axis] = sign * (0.85 + 0.1 * n);
        grid.set(grid.index(p), map::Cell::occupied);
      }
      EXPECT_NEAR(prism_distance(grid, Vec3::Zero(), h, kFar), 0.6, 1e-9);
    }
  }
}

TEST(PrismDistance, TakesTheOutsideOfTheGridAsObstacle) {
  const map::OccupancyGrid grid(Vec3::Zero(), 0.1, Index3(40, 40, 40), map::Cell::free);
  const PerDirection h{0.3, 0.2, 0.1, 0.25, 0.25};
  EXPECT_NEAR(prism_distance(grid, Vec3(1.0, 2, 2), h, kFar), 0.7, 1e-9);
  EXPECT_NEAR(prism_distance(grid, Vec3(2, 3.55, 2), h, kFar), 0.25, 1e-9);
  EXPECT_NEAR(prism_distance(grid, Vec3(2, 2, 0.4), h, kFar), 0.3, 1e-9);
  EXPECT_EQ(prism_distance(grid, Vec3(2, 2, 0.05), h, kFar), 0);
  EXPECT_EQ(prism_distance(grid, Vec3(2, 2, -3), h, kFar), 0);
}

TEST(PrismDistance, ReturnsTheLimitWhenNothingIsNearer) {
  const map::OccupancyGrid grid = one_voxel(Vec3(1.0, 0, 0));
  const PerDirection h{0.1, 0.1, 0.1, 0.1, 0.1};
  EXPECT_DOUBLE_EQ(prism_distance(grid, Vec3::Zero(), h, 0.5), 0.5);
  EXPECT_NEAR(prism_distance(grid, Vec3::Zero(), h, 1.5), 0.9, 1e-9);
}

TEST(SweptPrismDistance, IsNeverFartherThanAnyPositionOnTheWay) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> motion(-0.3, 0.3), part(0.0, 1.0);
  for (int trial = 0; trial < 200; ++trial) {
    const map::OccupancyGrid grid = random_grid(random, 0.005);
    const Vec3 from = random_point(random, grid);
    const Vec3 to = from + Vec3(motion(random), motion(random), motion(random));
    const PerDirection h = random_half_widths(random);
    const double swept = swept_prism_distance(grid, from, to, h, 0.6);
    for (const double s : {0.0, 1.0, part(random), part(random), part(random)}) {
      EXPECT_LE(swept, prism_distance(grid, from + s * (to - from), h, 0.6) + 1e-9);
    }
  }
}

TEST(SweptPrismDistance, OfABoxMovingAlongAnAxisIsExact) {
  std::mt19937 random(8);
  for (int trial = 0; trial < 60; ++trial) {
    const map::OccupancyGrid grid = random_grid(random, 0.005);
    const Vec3 from = random_point(random, grid);
    PerDirection h = random_half_widths(random);
    h[kXyPlus] = h[kXyMinus] = 1.0;
    Vec3 to = from;
    to[trial % 3] += 0.25;
    double nearest = 0.6;
    for (int s = 0; s <= 50; ++s)
      nearest = std::min(nearest, prism_distance(grid, from + s / 50.0 * (to - from), h, 0.6));
    EXPECT_NEAR(swept_prism_distance(grid, from, to, h, 0.6), nearest, 0.005 / 2 + 1e-9);  // half a sample step
  }
}

TEST(SweptPrismDistance, WithoutMotionIsThePrismDistance) {
  std::mt19937 random(9);
  const map::OccupancyGrid grid = random_grid(random, 0.01);
  for (int trial = 0; trial < 100; ++trial) {
    const Vec3 p = random_point(random, grid);
    const PerDirection h = random_half_widths(random);
    EXPECT_NEAR(swept_prism_distance(grid, p, p, h, 0.6), prism_distance(grid, p, h, 0.6), 1e-12);
  }
}

}  // namespace
}  // namespace backwash::reach
