// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "core/field/lateral/lateral_kernels.hpp"
#include "core/field/sight/sight.hpp"
#include "core/field/sight/sight_lines.hpp"
#include "tests/field/brute_force.hpp"
#include "tests/field/scenes.hpp"
#include "tests/support/line_of_sight.hpp"

namespace backwash::field {
namespace {

using map::Cell;
using map::OccupancyGrid;

bool seen(const SightMap& sight, const Vec3& p, const Vec3& c) { return sight.line_of_sight(sight.viewpoint(p), c); }

/// 6³ voxels of 1 m; segments are given whole, the 2 m that are left out are added here.
struct Lab {
  OccupancyGrid grid{Vec3::Zero(), 1, Index3(6, 6, 6), Cell::free};
  void block(int i, int j, int k) { grid.set(Index3(i, j, k), Cell::occupied); }
  bool clear(const Vec3& from, const Vec3& to) const {
    const Vec3 c = to + 2 * (to - from).normalized();
    const bool plain = line_of_sight(grid, from, c);
    EXPECT_EQ(seen(SightMap(grid), from, c), plain);
    return plain;
  }
};

TEST(LineOfSight, EqualsTheClosedBoxTestOfEveryVoxelOnRandomSegments) {
  std::mt19937 random(7);
  int blocked = 0, total = 0;
  for (unsigned seed = 0; seed < 8; ++seed) {
    const double a = 0.1 + 0.05 * seed;
    const OccupancyGrid grid = scene::random_map(seed, a);
    const SightMap sight(grid);
    const auto occupied = oracle::occupied_centers(grid);
    // Ends anywhere, a little outside the grid as well; every second pair on the lattice of half voxels, where segments
    // run through edges, corners and inside faces.
    std::uniform_real_distribution<double> u(-3, 21);
    std::uniform_int_distribution<int> lattice(-4, 40);
    for (int n = 0; n < 2500; ++n, ++total) {
      const auto point = [&]() -> Vec3 {
        if (n % 2) return grid.origin() + a * Vec3(u(random), u(random), u(random));
        return grid.origin() + a * 0.5 * Vec3(lattice(random), lattice(random), lattice(random));
      };
      const Vec3 p = point(), c = point();
      const bool expected = oracle::sees(occupied, a, p, c);
      ASSERT_EQ(line_of_sight(grid, p, c), expected) << "seed " << seed << " n " << n;
      ASSERT_EQ(seen(sight, p, c), expected) << "seed " << seed << " n " << n;
      blocked += !expected;
    }
  }
  EXPECT_GT(blocked, total / 4);
  EXPECT_LT(blocked, total * 9 / 10);
}

TEST(LineOfSight, DoesNotLeakBetweenTwoVoxelsThatTouchAtAnEdge) {
  Lab lab;
  lab.block(2, 3, 2);
  lab.block(3, 2, 2);
  EXPECT_FALSE(lab.clear({1.5, 1.5, 2.5}, {4.5, 4.5, 2.5}));
  EXPECT_FALSE(lab.clear({1.5, 1.5, 2.1}, {4.5, 4.5, 2.9}));
  EXPECT_TRUE(lab.clear({1.5, 1.5, 3.5}, {4.5, 4.5, 3.5}));
}

TEST(LineOfSight, IsBlockedByAnyVoxelThatTouchesTheEdgeOrCornerItPasses) {
  for (int n = 0; n < 8; ++n) {
    Lab lab;
    lab.block(2 + (n & 1), 2 + (n >> 1 & 1), 2 + (n >> 2));  // the eight voxels around the corner (3, 3, 3)
    for (const Vec3& d : {Vec3(1, 1, 1), Vec3(1, -1, 1), Vec3(-1, 1, 1), Vec3(1, 1, -1), Vec3(1, 0.25, -0.5)})
      EXPECT_FALSE(lab.clear(Vec3(3, 3, 3) - 1.5 * d, Vec3(3, 3, 3) + 1.5 * d)) << n << " along " << d.transpose();
  }
  Lab edge;
  edge.block(2, 2, 2);
  EXPECT_FALSE(edge.clear({3, 3, 0.5}, {3, 3, 4.5}));        // along an edge
  EXPECT_FALSE(edge.clear({3, 2.5, 0.5}, {3, 2.5, 4.5}));    // inside a face
  EXPECT_FALSE(edge.clear({3.5, 2.5, 2.5}, {3, 2.5, 2.5}));  // ends on a face
  EXPECT_FALSE(edge.clear({3, 2.5, 2.5}, {3.5, 2.5, 2.5}));  // starts on a face
  EXPECT_TRUE(edge.clear({3.001, 2.5, 0.5}, {3.001, 2.5, 4.5}));
  EXPECT_TRUE(edge.clear({3.001, 3.001, 0.5}, {3.001, 3.001, 4.5}));
}

TEST(LineOfSight, LeavesTheLastTwoEdgesOut) {
  Lab lab;
  lab.block(4, 2, 2);
  EXPECT_TRUE(line_of_sight(lab.grid, Vec3(0.5, 2.5, 2.5), Vec3(5.99, 2.5, 2.5)));   // seen part ends at 3.99
  EXPECT_FALSE(line_of_sight(lab.grid, Vec3(0.5, 2.5, 2.5), Vec3(6.01, 2.5, 2.5)));  // at 4.01
  EXPECT_TRUE(line_of_sight(lab.grid, Vec3(4.5, 2.5, 2.5), Vec3(5.5, 3.5, 3.5)));    // nothing but the end
  EXPECT_TRUE(line_of_sight(lab.grid, Vec3(4.5, 2.5, 2.5), Vec3(4.5, 2.5, 2.5)));
}

TEST(LineOfSight, IsNotBlockedByUnknownOrOutside) {
  OccupancyGrid grid(Vec3::Zero(), 1, Index3(6, 6, 6), Cell::unknown);
  EXPECT_TRUE(line_of_sight(grid, Vec3(0.5, 0.5, 0.5), Vec3(5.5, 5.5, 5.5)));
  EXPECT_TRUE(line_of_sight(grid, Vec3(-50, 0.5, 0.5), Vec3(50, 5.5, 5.5)));
  grid.set(Index3(5, 5, 5), Cell::occupied);
  EXPECT_FALSE(line_of_sight(grid, Vec3(20, 5.5, 5.5), Vec3(-20, 5.5, 5.5)));
}

constexpr int kRadius = 9, kRange = 8;
constexpr double kRange2 = kRange * kRange;

Eigen::Vector2d normal(double angle) { return {std::cos(angle), std::sin(angle)}; }

/// A bundle of normals about an angle, within one quadrant.
SightLines::Bundle bundle(double from, double to) {
  const Eigen::Vector2d a = normal(from), b = normal(to);
  return {{std::min(a.x(), b.x()), std::min(a.y(), b.y())}, {std::max(a.x(), b.x()), std::max(a.y(), b.y())}};
}

/// Centre of the element of normal m at an offset of columns and y layers up, voxel edges; column 0's voxel is at 0.
Vec3 element(int dx, int dy, int y, const Eigen::Vector2d& m) { return {dx + 0.5 * m.x(), dy + 0.5 * m.y(), 1.0 * y}; }

/// The line of sight's open part meets the voxels of a column in layers low … high.
bool meets_column(const Vec3& c, const ColumnOffset& column, int low, int high) {
  const auto line = open_part(Vec3::Constant(-0.5), 1, Vec3::Zero(), c);
  for (int z = low; line && z <= high; ++z)
    if (meets(*line, Index3(column.x, column.y, z))) return true;
  return false;
}

TEST(SightLines, HoldEveryColumnCrossedAndMarkThoseThatEveryLineCrosses) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  std::size_t may = 0, must = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const double from = std::numbers::pi / 2 * (trial % 4 + 0.8 * unit(random)), to = from + 0.3 * unit(random);
    const SightLines lines(std::vector{bundle(from, to)}, kRadius, kRange2);
    for (int n = 0; n < 300; ++n) {
      const int dx = static_cast<int>(19 * unit(random)) - 9, dy = static_cast<int>(19 * unit(random)) - 9;
      const Eigen::Vector2d m = normal(from + (to - from) * unit(random));
      const int y = static_cast<int>(9 * unit(random)) - 4;
      const Vec3 c = element(dx, dy, y, m);
      if (dx * m.x() + dy * m.y() > -0.5 || c.squaredNorm() > kRange2) continue;
      const auto& line = lines.at(0, dx, dy);
      const auto crossings = lines.crossings(line);
      for (int i = -kRadius; i <= kRadius; ++i)
        for (int j = -kRadius; j <= kRadius; ++j) {
          const ColumnOffset column{static_cast<std::int16_t>(i), static_cast<std::int16_t>(j)};
          const auto found = std::ranges::find_if(crossings, [&](const auto& o) { return o.x == i && o.y == j; });
          const bool crossed = meets_column(c, column, -9, 9);
          ASSERT_TRUE(!crossed || found != crossings.end()) << dx << ' ' << dy << ": " << i << ' ' << j;
          const bool every = found != crossings.end() && found - crossings.begin() < line.must;
          ASSERT_TRUE(crossed || !every) << dx << ' ' << dy << ' ' << y << ": " << i << ' ' << j;
          may += crossed;
          must += every;
        }
    }
  }
  EXPECT_GT(must, may / 2) << "else nothing is known to be hidden";
}

/// hide() for one line and one column, by itself in the lane `lane` of eight.
std::uint64_t hidden_by(const Vec3& c, const ColumnOffset& column, int low, int high, std::size_t lane) {
  std::array<double, 8> x{}, y{}, range{};
  std::array<LineFromAbove, 8> lines{};
  x.fill(1);
  y.fill(1);
  x[7 - lane] = c.x();
  y[7 - lane] = c.y();
  range[7 - lane] = kRange;
  make_lines(x.data(), y.data(), range.data(), 8, lines.data());
  std::array<std::uint32_t, 8> line{};
  std::array<std::int32_t, 8> columns_x{}, columns_y{}, lows{}, highs{};
  std::array<std::uint64_t, 8> hidden{};
  line[lane] = static_cast<std::uint32_t>(7 - lane);
  columns_x[lane] = column.x;
  columns_y[lane] = column.y;
  lows[lane] = low;
  highs[lane] = high;
  hide(lines.data(), {line.data(), columns_x.data(), columns_y.data(), lows.data(), highs.data(), hidden.data()}, 8);
  return hidden[lane];
}

TEST(LineFromAbove, HidesTheHeightsThatTheLineOfSightSaysItHides) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto draw = [&](int low, int high) { return low + static_cast<int>((high - low + 1) * unit(random)); };
  std::size_t hidden = 0, open = 0;
  for (int n = 0; n < 20000; ++n) {
    const int dx = draw(-8, 8), dy = draw(-8, 8);
    // Every third along an axis: lines through edges and corners of voxels.
    const Eigen::Vector2d m =
        n % 3 ? normal(6.3 * unit(random)) : normal(std::numbers::pi / 2 * draw(0, 3)).array().round().matrix();
    if (dx * m.x() + dy * m.y() > -0.5) continue;
    const ColumnOffset column{static_cast<std::int16_t>(draw(std::min(dx, 0), std::max(dx, 0))),
                              static_cast<std::int16_t>(draw(std::min(dy, 0), std::max(dy, 0)))};
    const int low = draw(-6, 4), high = low + draw(0, 3);
    const std::uint64_t word = hidden_by(element(dx, dy, 0, m), column, low, high, static_cast<std::size_t>(n % 8));
    for (int y = -kRange; y <= kRange; ++y) {
      // Seen from the height y over the element, at 0: the element is −y layers up, and so are the voxels.
      const bool meets = meets_column(element(dx, dy, -y, m), column, low - y, high - y);
      ASSERT_EQ(word >> (kCentre + y) & 1, meets ? 1U : 0U)
          << dx << ' ' << dy << ' ' << m.transpose() << ", column " << column.x << ' ' << column.y << ", " << low
          << " … " << high << " from " << y;
      (meets ? hidden : open) += 1;
    }
  }
  EXPECT_GT(hidden, 10000U);
  EXPECT_GT(open, 10000U);
}

}  // namespace
}  // namespace backwash::field
