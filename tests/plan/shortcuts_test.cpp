// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/search/shortcuts.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/config/config.hpp"
#include "core/map/distance_field.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/search/kinodynamic_astar.hpp"
#include "core/plan/search/way.hpp"
#include "core/plan/world/world.hpp"
#include "tests/support/regions.hpp"

namespace backwash::plan {
namespace {

using map::Cell;
using map::OccupancyGrid;

constexpr AxisLimits kLimits{1.35, 1.8};

Vec3 drawn(std::mt19937& random, double size) {
  std::uniform_real_distribution<double> u(-size, size);
  const double x = u(random), y = u(random), z = u(random);
  return {x, y, z};
}

double duration(const std::vector<Motion>& motions) {
  double total = 0;
  for (const Motion& m : motions) total += m.duration;
  return total;
}

/// Least time of one axis by looking: the speed after each step of a grid, reached from all speeds before it.
double least_time_by_search(double d, double v, double w) {
  double best = INFINITY;
  for (double c = -kLimits.v_max; c <= kLimits.v_max; c += 1e-3) {  // any optimal motion has one cruising or peak speed
    const double first = std::abs(c - v) / kLimits.a_max, last = std::abs(w - c) / kLimits.a_max;
    const double rest = d - first * (v + c) / 2 - last * (c + w) / 2;
    if (std::abs(c) < 1e-4 || rest / c < 0) continue;
    best = std::min(best, first + last + rest / c);
  }
  return best;
}

TEST(Quickest, JoinsTwoStatesWithinTheLimits) {
  std::mt19937 random(1);
  int found = 0;
  for (int n = 0; n < 2000; ++n) {
    const State from{drawn(random, 3), drawn(random, 1.3)}, to{drawn(random, 3), drawn(random, 1.3)};
    const auto motions = quickest(from, to, kLimits, INFINITY);
    if (!motions) continue;
    ++found;
    State at = from;
    for (const Motion& m : *motions) {
      EXPECT_LT((m.position(0) - at.p_W).norm() + (m.velocity(0) - at.v_W).norm(), 1e-9);
      EXPECT_LE(m.peak_velocity().maxCoeff(), kLimits.v_max + 1e-8);
      EXPECT_LE(m.peak_acceleration().maxCoeff(), kLimits.a_max + 1e-9);
      at = m.end();
    }
    EXPECT_LT((at.p_W - to.p_W).norm() + (at.v_W - to.v_W).norm(), 1e-9);
  }
  EXPECT_GT(found, 1900);
}

TEST(Quickest, TakesTheLeastTimeOfItsSlowestAxis) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> speed(-1.3, 1.3), way(-3, 3);
  for (int n = 0; n < 200; ++n) {
    const double d = way(random), v = speed(random), w = speed(random);
    const auto motions = quickest({{0, 0, 0}, {v, 0, 0}}, {{d, 0, 0}, {w, 0, 0}}, kLimits, INFINITY);
    ASSERT_TRUE(motions);
    EXPECT_NEAR(duration(*motions), least_time_by_search(d, v, w), 0.02) << d << " m, " << v << " to " << w << " m/s";
  }
  const auto rest = quickest({{0, 0, 0}, Vec3::Zero()}, {{1, -4, 2}, Vec3::Zero()}, kLimits, INFINITY);
  ASSERT_TRUE(rest);
  EXPECT_NEAR(duration(*rest), 4 / 1.35 + 1.35 / 1.8, 1e-9);
}

TEST(Quickest, IsNothingThatTakesLonger) {
  const State from{{0, 0, 0}, Vec3::Zero()}, to{{4, 0, 0}, Vec3::Zero()};
  const double T = 4 / 1.35 + 1.35 / 1.8;
  EXPECT_FALSE(quickest(from, to, kLimits, T - 1e-6));
  EXPECT_TRUE(quickest(from, to, kLimits, T + 1e-6));
  EXPECT_FALSE(quickest({{0, 0, 0}, {1.4, 0, 0}}, to, kLimits, INFINITY));
}

TEST(Way, OfSingleVoxelsExistsExactlyWhereFacesJoin) {
  std::mt19937 random(3);
  int joined = 0, apart = 0;
  for (int n = 0; n < 60; ++n) {
    OccupancyGrid grid({-1, 0, 2}, 0.1, {14, 13, 9}, Cell::free);
    for (std::size_t i = 0; i < grid.cell_count(); ++i)
      if (random() % 100 < 62) grid.set(grid.voxel(i), Cell::occupied);
    const Index3 from(1, 1, 1), to(12, 11, 7);
    grid.set(from, Cell::free);
    grid.set(to, Cell::free);
    const auto region = test::regions(grid, [&](const Index3& v) { return grid.free(v); });
    const SafeSpace space(grid);
    for (std::size_t i = 0; i < grid.cell_count(); i += 7) {
      if (!grid.free(grid.voxel(i))) continue;
      const Vec3 goal = grid.center(grid.voxel(i)) + Vec3(0.01, 0.02, -0.03);
      const auto way = way_over_blocks(space, grid.center(from), goal, 1, SIZE_MAX, Clock::time_point::max());
      const bool one = region[i] == region[grid.linear(from)];
      ASSERT_EQ(way.status, one ? Way::Status::found : Way::Status::none);
      (one ? joined : apart) += 1;
      if (!one) continue;
      EXPECT_EQ(way.points.front(), grid.center(from));
      EXPECT_EQ(way.points.back(), goal);
      const auto motions = along(space, {grid.center(from), Vec3::Zero()}, way.points, kLimits);
      EXPECT_TRUE(!motions.empty() || goal == grid.center(from));
    }
  }
  EXPECT_GT(joined, 100);
  EXPECT_GT(apart, 100);
}

TEST(Way, GivesUpAtItsNumberOfBlocksAndAtItsDeadline) {
  const OccupancyGrid grid({0, 0, 0}, 0.1, {60, 60, 30}, Cell::free);
  const SafeSpace space(grid);
  const Vec3 from(0.5, 0.5, 0.5), to(5.5, 5.5, 2.5);
  const auto way = [&](std::size_t most, Clock::time_point deadline) {
    return way_over_blocks(space, from, to, 2, most, deadline).status;
  };
  EXPECT_EQ(way(20, Clock::time_point::max()), Way::Status::given_up);
  EXPECT_EQ(way(SIZE_MAX, Clock::now() - std::chrono::seconds(1)), Way::Status::given_up);
  EXPECT_EQ(way(SIZE_MAX, Clock::time_point::max()), Way::Status::found);
}

/// The benchmark's forest, 0.25 m from its obstacles.
OccupancyGrid forest() {
  OccupancyGrid grid = map::builtin_scene("forest-1", 0.1).value();
  const map::DistanceField distance(grid);
  for (std::size_t n = 0; n < grid.cell_count(); ++n)
    if (grid.at(n) == Cell::free && distance.at(grid.voxel(n)) < 0.25) grid.set(grid.voxel(n), Cell::unknown);
  return grid;
}

TEST(Shortened, CostsLessAndStaysClear) {
  const SafeSpace space(forest());
  const SafeView view(space);
  std::mt19937_64 random(4);
  const auto draw = [&] {
    for (;;) {
      const auto n = static_cast<int>(random() % static_cast<std::size_t>(space.size().prod()));
      const Index3 v(n % space.size().x(), n / space.size().x() % space.size().y(),
                     n / (space.size().x() * space.size().y()));
      if (space.passable(v)) return space.center(v);
    }
  };
  double before = 0, after = 0;
  for (int n = 0; n < 20; ++n) {
    const Vec3 from = draw(), to = draw();
    const auto way = way_over_blocks(view, from, to, 1, SIZE_MAX, Clock::time_point::max());
    if (way.status != Way::Status::found) continue;
    const auto stops = along(view, {from, Vec3::Zero()}, way.points, kLimits);
    const auto motions = shortened(view, stops, kLimits, 64.8);
    before += cost_of(stops, 64.8);
    after += cost_of(motions, 64.8);
    EXPECT_LE(cost_of(motions, 64.8), cost_of(stops, 64.8));
    State at{from, Vec3::Zero()};
    for (const Motion& m : motions) {
      for (int k = 0; k <= 20; ++k) EXPECT_TRUE(view.passable(space.index(m.position(m.duration * k / 20))));
      EXPECT_LT((m.position(0) - at.p_W).norm() + (m.velocity(0) - at.v_W).norm(), 1e-9);
      at = m.end();
    }
    EXPECT_LT((at.p_W - to).norm() + at.v_W.norm(), 1e-9);
  }
  EXPECT_LT(after, 0.8 * before);
}

TEST(Search, DoesNotExplodeWhereTheStraightWayEndsAtAnObstacle) {
  const auto world =
      build_world(map::builtin_scene("forest-1", 0.1).value(), config::load_model("builtin:quad-5in").value(),
                  config::load_vehicle("builtin:quad-5in").value());
  const std::pair<Vec3, Vec3> hard[] = {{{-10.15, 1.15, 3.35}, {-16.05, 2.15, 1.15}},
                                        {{4.55, 3.45, 1.45}, {5.25, 9.65, 1.55}},
                                        {{-8.95, 1.65, 1.05}, {-2.85, 4.05, 1.55}}};
  for (const auto& [from, to] : hard) {
    const auto found =
        search(world->safe, {from, Vec3::Zero()}, to, {1.35, 1.8, 400'000, Clock::now() + std::chrono::seconds(10)});
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_LT(found->expanded, 8000u);  // 41,430, 44,747 and 22,780 states before ways were shortened
    EXPECT_LT(found->cost, 2 * found->lower_bound);
  }
}

TEST(Search, FindsAWayFromAStartThatCannotStopInTime) {
  // Braking ends in the wall; turning aside does not.
  OccupancyGrid grid({0, 0, 0}, 0.1, {80, 60, 20}, Cell::free);
  for (int j = 0; j < 34; ++j)
    for (int k = 0; k < 20; ++k) grid.set({25, j, k}, Cell::occupied);
  const State start{{1.95, 3.25, 1}, {1.5, 0.9, 0}};
  const SafeSpace space(grid);
  const auto found = search(space, start, {6, 1, 1}, {1.5, 1.8, 400'000, Clock::now() + std::chrono::seconds(10)});
  ASSERT_TRUE(found) << found.error().message;
  for (const Motion& m : found->motions) EXPECT_TRUE(SafeView(space).clear(m));
}

}  // namespace
}  // namespace backwash::plan
