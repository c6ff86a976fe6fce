// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>
#include <vector>

#include "core/reach/clearance.hpp"

namespace backwash::reach {
namespace {

using Vec2 = Eigen::Vector2d;

constexpr double kTaken = 0.18;  // m

double uniform(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution(low, high)(random);
}

TubeStep entry(const Vec3& center, const PerDirection& half_widths) {
  TubeStep step{};
  step.center.p_W = center;
  step.half_widths_interval = half_widths;
  return step;
}

ReachTube random_tube(std::mt19937_64& random) {
  ReachTube tube;
  Vec3 p(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1));
  for (int n = 0; n < 6; ++n) {
    PerDirection h;
    for (double& width : h) width = uniform(random, 0.01, 0.25);
    tube.push_back(entry(p, h));
    p += Vec3(uniform(random, 0, 0.2), uniform(random, -0.1, 0.1), uniform(random, -0.05, 0.05));
  }
  return tube;
}

/// Corners of {x : |unit(d)·x| ≤ h_d, d horizontal}: every pair of its lines, kept where all slabs hold.
std::vector<Vec2> corners(const PerDirection& h) {
  std::vector<std::pair<Vec2, double>> lines;
  for (const Direction d : {kX, kY, kXyPlus, kXyMinus})
    for (const double sign : {1.0, -1.0}) lines.emplace_back(sign * unit(d).head<2>(), h[d]);
  std::vector<Vec2> kept;
  for (const auto& [a, ha] : lines)
    for (const auto& [b, hb] : lines) {
      Eigen::Matrix2d m;
      m << a.transpose(), b.transpose();
      if (std::abs(m.determinant()) < 1e-6) continue;
      const Vec2 x = m.inverse() * Vec2(ha, hb);
      bool inside = true;
      for (const auto& [n, hn] : lines) inside &= n.dot(x) <= hn + 1e-12;
      if (inside) kept.push_back(x);
    }
  return kept;
}

Vec3 half_of(const Cube& cube) { return Vec3::Constant(cube.edge / 2) + cube.more / 2; }

/// Whether some sampled point of the set along the motion lies within kTaken of the cube: then it is blocked for sure.
bool touches(const TubeStep& step, const Vec3& to, const Cube& cube, std::mt19937_64& random) {
  const auto octagon = corners(step.half_widths_interval);
  for (int n = 0; n < 4000; ++n) {
    const double s = uniform(random, 0, 1), t = uniform(random, 0, 1);
    // Corners are over-represented: the nearest point is often one.
    const Vec2 a = octagon[random() % octagon.size()], b = octagon[random() % octagon.size()];
    const Vec2 xy = n % 2 ? a : Vec2(t * a + (1 - t) * b);
    const double z = step.half_widths_interval[kZ] * (n % 3 ? (n % 3 == 1 ? 1 : -1) : uniform(random, -1, 1));
    const Vec3 p = step.center.p_W + s * (to - step.center.p_W) + Vec3(xy.x(), xy.y(), z);
    const Vec3 off = ((p - cube.center).cwiseAbs() - half_of(cube)).cwiseMax(0);
    if (off.norm() <= kTaken) return true;
  }
  return false;
}

/// The prism at the middle of a motion that encloses it: each slab as narrow as the corners allow, and half the motion
/// wider.
PerDirection enclosing(const PerDirection& h, const Vec3& half) {
  PerDirection wide{};
  for (const Direction d : {kX, kY, kXyPlus, kXyMinus}) {
    for (const Vec2& c : corners(h)) wide[d] = std::max(wide[d], unit(d).head<2>().dot(c));
    wide[d] += std::abs(unit(d).dot(half));
  }
  wide[kZ] = h[kZ] + std::abs(half.z());
  return wide;
}

/// Whether a plane separates the cube by more than kTaken from that prism: then it is clear.
bool separated(const TubeStep& step, const Vec3& to, const Cube& cube, std::mt19937_64& random) {
  const Vec3 half = (to - step.center.p_W) / 2;
  const PerDirection wide = enclosing(step.half_widths_interval, half);
  const auto octagon = corners(wide);
  for (int k = 0; k < 3000; ++k) {
    Vec3 n(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1));
    if (k % 3 == 0) n = unit(static_cast<Direction>(random() % 5)) * (random() % 2 ? 1 : -1);
    if (k % 3 == 1) n.z() = 0;
    n.normalize();
    double reach = 0;
    for (const Vec2& c : octagon) reach = std::max(reach, n.head<2>().dot(c));
    reach += std::abs(n.z()) * wide[kZ];
    if (n.dot(cube.center - step.center.p_W - half) - reach - n.cwiseAbs().dot(half_of(cube)) > kTaken) return true;
  }
  return false;
}

TEST(FirstBlocked, AgreesWithSampledPointsAndSeparatingPlanes) {
  std::mt19937_64 random(1);
  int touched = 0, clear = 0, open = 0;
  for (int round = 0; round < 400; ++round) {  // compilers draw in an order of their own
    const ReachTube tube = random_tube(random);
    const Vec3 near = tube[random() % tube.size()].center.p_W;
    const Cube cube{near + Vec3(uniform(random, -0.7, 0.7), uniform(random, -0.7, 0.7), uniform(random, -0.5, 0.5)),
                    uniform(random, 0.05, 0.2),
                    round % 2 ? Vec3::Zero() : Vec3(uniform(random, 0, 1), uniform(random, 0, 0.5), 0.2)};
    const std::size_t first = first_blocked(tube, 0, cube, kTaken);
    for (std::size_t n = 0; n < tube.size(); ++n) {
      const Vec3 to = tube[std::min(n + 1, tube.size() - 1)].center.p_W;
      if (touches(tube[n], to, cube, random)) {
        ++touched;
        ASSERT_LE(first, n) << "round " << round;
        ASSERT_EQ(first_blocked(tube, n, cube, kTaken), n) << "round " << round;
      } else if (separated(tube[n], to, cube, random)) {
        ++clear;
        ASSERT_NE(first_blocked(tube, n, cube, kTaken), n) << "round " << round;
      } else {
        ++open;
      }
    }
  }
  EXPECT_GT(touched, 300);
  EXPECT_GT(clear, 300);
  EXPECT_LT(open, 0.25 * (touched + clear));  // what the two oracles leave undecided lies at the border
}

TEST(FirstBlocked, IsTheEntryThatTheMapFindsTooNear) {
  std::mt19937_64 random(2);
  for (int round = 0; round < 300; ++round) {
    const ReachTube tube = random_tube(random);
    map::OccupancyGrid grid({-4, -4, -4}, 0.1, {90, 80, 80}, map::Cell::free);
    const Vec3 off(uniform(random, -0.5, 0.5), uniform(random, -0.5, 0.5), uniform(random, -0.5, 0.5));
    const Index3 v = grid.index(tube[random() % tube.size()].center.p_W + off);
    grid.set(v, map::Cell::occupied);
    std::size_t expected = tube.size();
    for (std::size_t n = tube.size(); n-- > 0;) {
      const Vec3& to = tube[std::min(n + 1, tube.size() - 1)].center.p_W;
      if (swept_prism_distance(grid, tube[n].center.p_W, to, tube[n].half_widths_interval, 1) <= kTaken) expected = n;
    }
    EXPECT_EQ(first_blocked(tube, 0, {grid.center(v), 0.1}, kTaken), expected);
  }
}

TEST(FirstBlocked, PastTheEndTheLastEntryHolds) {
  const ReachTube tube{entry({0, 0, 0}, {0.1, 0.1, 0.1, 0.1, 0.1}), entry({3, 0, 0}, {0.1, 0.1, 0.1, 0.1, 0.1})};
  const Cube at_start{{0, 0, 0}, 0.1}, at_end{{3.1, 0, 0}, 0.1};
  EXPECT_EQ(first_blocked(tube, 0, at_start, kTaken), 0u);
  EXPECT_EQ(first_blocked(tube, 700, at_start, kTaken), tube.size());
  EXPECT_EQ(first_blocked(tube, 700, at_end, kTaken), 1u);
  EXPECT_EQ(first_blocked({}, 0, at_end, kTaken), 0u);
}

}  // namespace
}  // namespace backwash::reach
