// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "core/plan/search/kinodynamic_astar.hpp"

namespace backwash::plan {
namespace {

using map::Cell;
using map::OccupancyGrid;

SearchOptions options(double v_max, double a_max) {
  return {v_max, a_max, 400'000, Clock::now() + std::chrono::seconds(10)};
}

/// Room of 8 × 4 × 2 m with a wall of `thickness` voxels at x = 4 m that leaves y > `gap_from` open.
OccupancyGrid room_with_wall(int thickness, double gap_from) {
  OccupancyGrid grid({0, 0, 0}, 0.1, {80, 40, 20}, Cell::free);
  for (int i = 40; i < 40 + thickness; ++i)
    for (int j = 0; j * 0.1 < gap_from - 1e-9 && j < 40; ++j)
      for (int k = 0; k < 20; ++k) grid.set({i, j, k}, Cell::occupied);
  return grid;
}

void expect_flyable(const SearchResult& result, const OccupancyGrid& grid, const State& start, const Vec3& goal,
                    double v_max, double a_max) {
  State s = start;
  double cost = 0;
  for (const Motion& m : result.motions) {
    EXPECT_LT((m.position(0) - s.p_W).norm() + (m.velocity(0) - s.v_W).norm(), 1e-9);
    for (int k = 0; k <= 1000; ++k) {
      const double t = m.duration * k / 1000;
      ASSERT_TRUE(grid.free(grid.index(m.position(t)))) << m.position(t).transpose();
      EXPECT_LE(m.velocity(t).cwiseAbs().maxCoeff(), std::max(v_max, start.v_W.cwiseAbs().maxCoeff()) + 1e-6);
      EXPECT_LE(m.acceleration(t).cwiseAbs().maxCoeff(), a_max + 1e-6);
    }
    cost += m.effort();
    s = m.end();
  }
  EXPECT_LT((s.p_W - goal).norm(), 1e-9);
  EXPECT_LT(s.v_W.norm(), 1e-9);
  EXPECT_GE(result.cost, result.lower_bound * (1 - 1e-9));
  EXPECT_GT(result.cost, cost);
}

TEST(SafeSpace, BoxQueryEqualsCountingVoxels) {
  std::mt19937 random(1);
  OccupancyGrid grid({-1, 0, 2}, 0.2, {12, 9, 7}, Cell::free);
  for (std::size_t n = 0; n < grid.cell_count(); ++n)
    if (random() % 40 == 0) grid.set(grid.voxel(n), Cell::occupied);
  const SafeSpace cells(grid);
  std::vector<Index3> extra;  // blocked voxels that a search may pass all the same
  for (std::size_t n = 0; n < grid.cell_count() && extra.size() < 9; ++n)
    if (!grid.free(grid.voxel(n))) extra.push_back(grid.voxel(n));
  const SafeView space(cells), opened(cells, extra);
  std::uniform_real_distribution<double> u(-0.1, 1.1);
  int only_opened = 0;
  for (int i = 0; i < 3000; ++i) {
    const Vec3 extent = grid.size().cast<double>() * 0.2;
    const Vec3 a = grid.origin() + extent.cwiseProduct(Vec3(u(random), u(random), u(random)));
    const Vec3 b = a + 0.6 * Vec3(u(random), u(random), u(random)).cwiseAbs();
    const Index3 low = grid.index(a), high = grid.index(b);
    bool clear = true, clear_opened = true;
    for (int x = low.x(); x <= high.x(); ++x)
      for (int y = low.y(); y <= high.y(); ++y)
        for (int z = low.z(); z <= high.z(); ++z) {
          clear = clear && grid.free({x, y, z});
          clear_opened = clear_opened && (grid.free({x, y, z}) || std::ranges::count(extra, Index3(x, y, z)) > 0);
        }
    EXPECT_EQ(space.clear(Box{a, b}), clear);
    EXPECT_EQ(opened.clear(Box{a, b}), clear_opened);
    only_opened += clear_opened && !clear;
  }
  EXPECT_GT(only_opened, 20);
}

TEST(SafeSpace, KeepsRegionsApartUpToTheLastPartOfATileAndNeverSplitsOne) {
  OccupancyGrid grid({0, 0, 0}, 0.1, {60, 60, 40}, Cell::free);  // 72,000 voxels by themselves, 2,048 of a tile
  for (std::size_t n = 0; n < grid.cell_count(); ++n)
    if (grid.voxel(n).sum() % 2) grid.set(grid.voxel(n), Cell::occupied);
  grid.set({3, 2, 0}, Cell::free);  // joins its four neighbours and the one above
  const SafeSpace cells(grid);
  const SafeView space(cells);
  EXPECT_EQ(cells.region({2, 2, 0}), cells.region({4, 2, 0}));
  EXPECT_TRUE(space.may_join({2, 2, 0}, {3, 2, 1}));
  EXPECT_FALSE(space.may_join({2, 2, 0}, {6, 2, 0}));
  EXPECT_FALSE(space.may_join({0, 0, 0}, {58, 58, 38}));
  EXPECT_TRUE(space.may_join({56, 58, 38}, {58, 58, 38})) << "what is not known is not denied";
  EXPECT_FALSE(cells.passable({58, 59, 38}));
}

TEST(SafeSpace, SweptSetNeverMissesAThinWall) {
  // A plate one voxel thick in free space: whichever motion has a sample in it or ends on its other side is not clear.
  OccupancyGrid grid({0, 0, 0}, 0.05, {80, 80, 40}, Cell::free);
  for (int j = 0; j < 80; ++j)
    for (int k = 0; k < 40; ++k) grid.set({40, j, k}, Cell::occupied);
  const SafeSpace cells(grid);
  const SafeView space(cells);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> u(-1, 1);
  int crossing = 0, clear = 0;
  for (int i = 0; i < 20000; ++i) {
    const State from{{2 + 0.8 * u(random), 2 + 0.5 * u(random), 1 + 0.2 * u(random)},
                     {3 * u(random), u(random), 0.3 * u(random)}};
    const Motion m = primitive(from, {4 * u(random), 2 * u(random), 0.5 * u(random)}, 0.4 + 0.3 * u(random));
    bool meets = false;
    for (int k = 0; k <= 400; ++k) meets = meets || !grid.free(grid.index(m.position(m.duration * k / 400)));
    meets = meets || (from.p_W.x() < 2) != (m.end().p_W.x() < 2);
    crossing += meets;
    clear += space.clear(m);
    EXPECT_FALSE(meets && space.clear(m));
    if (!meets && !space.clear(m)) {  // refused only for touching the plate's surroundings
      double nearest = INFINITY;
      for (int k = 0; k <= 400; ++k)
        nearest = std::min(nearest, std::abs(m.position(m.duration * k / 400).x() - 2.025));
      EXPECT_LT(nearest, 0.025 + 0.05 / 4);
    }
  }
  EXPECT_GT(crossing, 2000);
  EXPECT_GT(clear, 2000);
}

TEST(SafeSpace, MotionsNeedAtLeastTheTimeThatHopsSay) {
  const OccupancyGrid grid = room_with_wall(2, 3.0);
  const SafeSpace space(grid);
  const Vec3 goal(6, 1, 1);
  const auto hops = SafeView(space).hops_to(space.index(goal), space.index({2, 1, 1}));
  const auto found = search(space, {{2, 1, 1}, Vec3::Zero()}, goal, options(1.5, 2));
  ASSERT_TRUE(found);
  // Along a motion that ends at the goal: what is left of ∫ max|v| dt is at least (hops − 1) voxels.
  double left = 0;
  for (auto m = found->motions.rbegin(); m != found->motions.rend(); ++m)
    for (int k = 1000; k > 0; --k) {
      left += m->velocity(m->duration * (k - 0.5) / 1000).cwiseAbs().maxCoeff() * m->duration / 1000;
      const Vec3 p = m->position(m->duration * (k - 1) / 1000);
      EXPECT_GE(left + 1e-4, (static_cast<double>(hops.at(space.linear(space.index(p)))) - 1) * 0.1);
    }
}

TEST(Search, GoesRoundAThinWallToItsFarGapAtEverySpeed) {
  for (const int thickness : {1, 3}) {
    const OccupancyGrid grid = room_with_wall(thickness, 3.0);
    const SafeSpace space(grid);
    for (const double v_max : {0.3, 0.5, 1.0, 2.0, 3.0}) {
      const State start{{2.05, 1.05, 1.05}, Vec3::Zero()};
      const Vec3 goal(6.02, 1.01, 1.03);
      const auto found = search(space, start, goal, options(v_max, 2));
      ASSERT_TRUE(found) << "v_max " << v_max << ": " << found.error().message;
      expect_flyable(*found, grid, start, goal, v_max, 2);
    }
  }
}

TEST(Search, CostsLessThanTwiceTheLowerBoundInFreeSpace) {
  const OccupancyGrid grid({0, 0, 0}, 0.1, {60, 60, 30}, Cell::free);
  const SafeSpace space(grid);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int i = 0; i < 10; ++i) {
    const State start{{3 + 2 * u(random), 3 + 2 * u(random), 1.5 + 0.5 * u(random)},
                      {0.5 * u(random), 0.5 * u(random), 0}};
    const Vec3 goal(3 + 2 * u(random), 3 + 2 * u(random), 1.5 + 0.5 * u(random));
    const auto found = search(space, start, goal, options(1.5, 2));
    ASSERT_TRUE(found) << found.error().message;
    expect_flyable(*found, grid, start, goal, 1.5, 2);
    EXPECT_LT(found->cost, 2 * found->lower_bound);
  }
}

TEST(Search, NeverLeavesTheMap) {
  // Free up to the border: the way along the border must not lead outside, which is unknown.
  OccupancyGrid grid({0, 0, 0}, 0.1, {40, 10, 10}, Cell::free);
  for (int j = 0; j < 9; ++j)
    for (int k = 0; k < 9; ++k) grid.set({20, j, k}, Cell::occupied);
  const State start{{0.55, 0.45, 0.45}, Vec3::Zero()};
  const auto found = search(SafeSpace(grid), start, {3.5, 0.5, 0.5}, options(1, 2));
  ASSERT_TRUE(found);
  expect_flyable(*found, grid, start, {3.5, 0.5, 0.5}, 1, 2);
}

TEST(Search, KeepsItsDeadline) {
  const OccupancyGrid grid = room_with_wall(1, 3.0);
  auto o = options(0.3, 2);
  o.deadline = Clock::now();
  const auto found = search(SafeSpace(grid), {{2, 1, 1}, Vec3::Zero()}, {6, 1, 1}, o);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().kind, SearchFailure::Kind::deadline);
}

TEST(Search, IsDeterministic) {
  const OccupancyGrid grid = room_with_wall(1, 3.0);
  const SafeSpace space(grid);
  const auto a = search(space, {{2, 1, 1}, Vec3::Zero()}, {6, 1, 1}, options(1, 2));
  const auto b = search(space, {{2, 1, 1}, Vec3::Zero()}, {6, 1, 1}, options(1, 2));
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->expanded, b->expanded);
  EXPECT_EQ(a->cost, b->cost);
}

TEST(Sample, KeepsBothEndsAndEvenSteps) {
  const Motion m1 = primitive({{0, 0, 0}, {1, 0, 0}}, {0, 1, 0}, 0.55), m2 = primitive(m1.end(), {-1, 0, 0}, 0.3);
  const auto samples = sample({m1, m2}, 0.2);
  ASSERT_EQ(samples.positions.size(), 6u);
  EXPECT_NEAR(samples.step, 0.17, 1e-12);
  EXPECT_LT((samples.positions[1] - m1.position(0.17)).norm(), 1e-12);
  EXPECT_LT((samples.positions[4] - m2.position(0.68 - 0.55)).norm(), 1e-12);
  EXPECT_LT((samples.positions[5] - m2.end().p_W).norm(), 1e-12);
}

/// A corridor of 0.3 m along x with a side branch along y at its low end, in solid matter; moved by `shift`.
OccupancyGrid bent_corridor(const Vec3& shift) {
  OccupancyGrid grid(shift, 0.125, {64, 40, 4}, Cell::occupied);
  for (int k = 1; k < 3; ++k)
    for (int i = 1; i < 63; ++i) {
      for (int j = 1; j < 4; ++j) grid.set({i, j, k}, Cell::free);
      for (int j = 4; j < 39 && i < 4; ++j) grid.set({i, j, k}, Cell::free);
    }
  return grid;
}
const SearchOptions kUnhurried{1.0, 1.0, 400'000, Clock::now() + std::chrono::hours(1)};

// A key without the velocity would drop the way back through a voxel as visited.
TEST(Search, TheSamePlaceAtAnotherVelocityIsAnotherState) {
  const OccupancyGrid grid = bent_corridor(Vec3::Zero());
  const SafeSpace space(grid);
  // Away from the goal at full speed: it has to turn round and come back through where it started, then go round the
  // bend. The last resort, straight lines from rest to rest, would stand still at the bend.
  const State start{{2.0, 0.3125, 0.25}, {1.0, 0, 0}};
  const Vec3 goal(0.3125, 4.0, 0.25);
  const auto found = search(SafeView(space, {}), start, goal, kUnhurried);
  ASSERT_TRUE(found) << found.error().message;
  double farthest = 0;
  bool came_back = false, stood_at_the_bend = false;
  for (const Motion& m : found->motions)
    for (double t = 0; t < m.duration; t += m.duration / 50) {
      farthest = std::max(farthest, m.position(t).x());
      came_back = came_back || (m.velocity(t).x() < -0.1 && std::abs(m.position(t).x() - start.p_W.x()) < 0.1);
      stood_at_the_bend =
          stood_at_the_bend || (m.position(t).x() < 1.5 && m.position(t).y() < 3.5 && m.velocity(t).norm() < 1e-6);
    }
  EXPECT_GT(farthest, 2.4);
  EXPECT_TRUE(came_back);
  EXPECT_FALSE(stood_at_the_bend);
}

// A world moved by whole voxels hashes every state differently and must be searched alike.
TEST(Search, TheOrderOfTheOpenSetDoesNotDependOnWhereTheWorldLies) {
  const State start{{2.0, 0.3125, 0.25}, {0.5, 0, 0}};
  const Vec3 goal(0.3125, 4.0, 0.25);
  const SafeSpace here(bent_corridor(Vec3::Zero()));
  const auto first = search(SafeView(here, {}), start, goal, kUnhurried);
  ASSERT_TRUE(first) << first.error().message;
  for (const Vec3& shift : {Vec3(-16, 8, 2), Vec3(32, -64, 4)}) {
    const SafeSpace there(bent_corridor(shift));
    const auto moved = search(SafeView(there, {}), {start.p_W + shift, start.v_W}, goal + shift, kUnhurried);
    ASSERT_TRUE(moved) << moved.error().message;
    EXPECT_EQ(moved->expanded, first->expanded);
    EXPECT_NEAR(moved->cost, first->cost, 1e-9 * first->cost);
    EXPECT_EQ(moved->motions.size(), first->motions.size());
  }
}

}  // namespace
}  // namespace backwash::plan
