// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <numeric>
#include <queue>
#include <random>
#include <set>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/feasibility.hpp"
#include "core/plan/planner.hpp"
#include "tests/support/cost_of_set.hpp"

namespace backwash::plan {
namespace {

/// The narrow gap in coarse voxels: quick to build, and its only passage is known.
const World& narrow_gap() {
  static const auto world = build_world(*map::builtin_scene("narrow-gap", 0.2), *config::load_model("builtin:quad-5in"),
                                        *config::load_vehicle("builtin:quad-5in"));
  return *world;
}

double clearance(const World& world, const Index3& v) {
  return reach::hover_set(world.reach, world.grid, world.distance, world.bounds, world.grid.center(v)).clearance;
}

/// Labels by repeated relaxation: slower than a flood, and nothing in common with it.
std::vector<std::size_t> labels_where(const World& world, double at_least) {
  std::vector<std::size_t> label(world.grid.cell_count());
  std::iota(label.begin(), label.end(), std::size_t{0});
  const auto in = [&](const Index3& v) { return world.hover.safe(v) && clearance(world, v) >= at_least; };
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 0; i < label.size(); ++i) {
      const Index3 v = world.grid.voxel(i);
      if (!in(v)) continue;
      for (int axis = 0; axis < 3; ++axis) {
        Index3 next = v;
        next[axis] += 1;
        if (!in(next)) continue;
        auto &a = label[i], &b = label[world.grid.linear(next)];
        changed |= a != b;
        a = b = std::min(a, b);
      }
    }
  }
  return label;
}

TEST(HoverRegions, AreTheConnectedComponentsOfTheSafeVoxels) {
  const auto& world = narrow_gap();
  const auto found = hover_regions(world);
  const auto label = labels_where(world, -1);
  std::set<std::pair<std::size_t, std::size_t>> pairs;
  std::vector<std::size_t> count(found.regions.size());
  for (std::size_t i = 0; i < label.size(); ++i) {
    const Index3 v = world.grid.voxel(i);
    ASSERT_EQ(found.of_voxel[i].has_value(), world.hover.safe(v));
    if (!found.of_voxel[i]) continue;
    const std::size_t n = *found.of_voxel[i];
    pairs.insert({n, label[i]});
    ++count[n];
    const Vec3 p = world.grid.center(v);
    EXPECT_TRUE((p.array() > found.regions[n].low_W.array()).all() &&
                (p.array() < found.regions[n].high_W.array()).all());
    EXPECT_LE(clearance(world, v), found.regions[n].widest_clearance_m);
  }
  EXPECT_EQ(pairs.size(), found.regions.size()) << "regions and labels must name the same sets";
  ASSERT_FALSE(found.regions.empty());
  for (std::size_t n = 0; n < count.size(); ++n) {
    EXPECT_EQ(count[n], found.regions[n].voxels);
    EXPECT_NEAR(found.regions[n].volume_m3, static_cast<double>(count[n]) * 0.008, 1e-9);
    EXPECT_LE(found.regions[n].voxels, found.regions.front().voxels);
  }
}

TEST(WidestWay, HasTheLargestClearanceAtWhichItsEndsAreStillConnected) {
  const auto& world = narrow_gap();
  const Vec3 from(1, 0, 1), to(5, 0, 1);
  const auto way = widest_way(world, from, to);
  ASSERT_TRUE(way);
  ASSERT_TRUE(way->passable);
  EXPECT_NEAR(way->place_W.x(), 3.05, 0.35) << "the gap is at x = 2.9 … 3.2 m";
  const auto joined = [&](double at_least) {
    const auto label = labels_where(world, at_least);
    return label[world.grid.linear(world.grid.index(from))] == label[world.grid.linear(world.grid.index(to))];
  };
  const double stored = clearance(world, world.grid.index(way->place_W));
  EXPECT_TRUE(joined(stored - 1e-9));
  EXPECT_FALSE(joined(stored + 1e-6));
  EXPECT_GE(way->length_m, 4.0 - 0.4);
}

TEST(WidestWay, DoesNotExistThroughAWall) {
  const auto& world = narrow_gap();
  EXPECT_FALSE(widest_way(world, {1, 0, 1}, {3, 1.5, 1}));
  EXPECT_FALSE(widest_way(world, {1, 0, 1}, {30, 0, 1}));
}

/// A push on one side of the gap: sets around centres that are not their voxels'.
const World& pushed_gap() {
  static const auto world = [] {
    auto model = *config::load_model("builtin:quad-5in");
    model.extension = {{Law::push, Vec3(0.5, 0.2, 0), Vec3(0.05, 0.05, 0.05), 0}};
    return build_world(*map::builtin_scene("narrow-gap", 0.2), model, *config::load_vehicle("builtin:quad-5in"));
  }();
  return *world;
}

TEST(CostOfSet, IsThatOfEveryClearanceLookedFor) {
  for (const World* world : {&narrow_gap(), &pushed_gap()}) {
    const auto found = cost_of_set(*world), expected = test::cost_of_set(*world);
    EXPECT_GT(found.safe_at_centre, 1000u);
    EXPECT_EQ(found.safe_at_centre, expected.safe_at_centre);
    EXPECT_EQ(found.lost, expected.lost);
    EXPECT_GT(expected.quantile95_m, 0.001);
    EXPECT_NEAR(found.median_m, expected.median_m, 1e-12);
    EXPECT_NEAR(found.quantile95_m, expected.quantile95_m, 1e-12);
  }
}

/// The same craft with an integrator: the sets at the centres hold what it holds, too.
const World& held_gap() {
  static const auto world = [] {
    auto vehicle = *config::load_vehicle("builtin:quad-5in");
    vehicle.controller.velocity_integrator = {0.4, 0.4};
    return build_world(*map::builtin_scene("narrow-gap", 0.2), *config::load_model("builtin:quad-5in"), vehicle);
  }();
  return *world;
}

TEST(CostOfSet, OfAnIntegratorIsWhatTheFieldChangesAlongTheSetAndNotWhatIsHeld) {
  const auto without = cost_of_set(narrow_gap()), with = cost_of_set(held_gap()),
             expected = test::cost_of_set(held_gap());
  EXPECT_EQ(with.lost, expected.lost);
  EXPECT_NEAR(with.median_m, expected.median_m, 1e-12);
  EXPECT_LT(with.safe_at_centre, without.safe_at_centre);  // what is held makes the sets at the centres larger
  EXPECT_EQ(with.median_m, without.median_m);              // and is no part of what Σ over the set costs
}

TEST(CostOfSet, DoesNotDependOnHowTheWorkIsDivided) {
  const Parallel backwards = [](std::size_t count, const std::function<void(std::size_t, std::size_t)>& work) {
    for (std::size_t n = count; n-- > 0;) work(n, n + 1);
  };
  const auto whole = cost_of_set(narrow_gap()), divided = cost_of_set(narrow_gap(), backwards);
  EXPECT_EQ(whole.safe_at_centre, divided.safe_at_centre);
  EXPECT_EQ(whole.lost, divided.lost);
  EXPECT_EQ(whole.median_m, divided.median_m);
  EXPECT_EQ(whole.quantile95_m, divided.quantile95_m);
  EXPECT_EQ(set_against_margins(narrow_gap(), {0.2})[0].only_set_safe,
            set_against_margins(narrow_gap(), {0.2}, backwards)[0].only_set_safe);
}

TEST(FarthestPair, IsSafeAndFarApartAndStartsWhereOneCanTakeOff) {
  const auto& world = narrow_gap();
  const auto regions = hover_regions(world);
  const auto pair = farthest_pair(world, regions, [](const Vec3& p) { return p.x() < 5; });
  ASSERT_TRUE(pair);
  for (const Vec3& p : {pair->start_W, pair->goal_W}) {
    EXPECT_EQ(regions.of_voxel[world.grid.linear(world.grid.index(p))], 0u);
  }
  EXPECT_LT(pair->start_W.x(), 5) << "the start must pass the test of its take-off";
  EXPECT_FALSE(farthest_pair(world, regions, [](const Vec3&) { return false; }));
  EXPECT_GT((pair->start_W - pair->goal_W).norm(), 4.5) << "the room is 6 m long";
}

// Success where a path exists: an exhaustive search of the grid under the same hover map is the judge. The full count
// is bench_plan's `success`.

/// The voxels that hover-safe voxels with shared faces join with `from`: written out again, apart from SafeSpace.
std::vector<bool> joined(const World& world, const Index3& from) {
  std::vector<bool> seen(world.grid.cell_count(), false);
  std::queue<Index3> open;
  const auto visit = [&](const Index3& v) {
    if (!world.hover.safe(v) || seen[world.grid.linear(v)]) return;
    seen[world.grid.linear(v)] = true;
    open.push(v);
  };
  for (visit(from); !open.empty(); open.pop())
    for (int axis = 0; axis < 3; ++axis)
      for (const int step : {-1, 1}) visit(open.front() + step * Index3::Unit(axis));
  return seen;
}

/// Plans `count` random pairs of hover-safe voxels; the status must say what the judge says.
void expect_success(const World& world, std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto draw = [&] {
    for (;;) {
      const Index3 v = world.grid.voxel(random() % world.grid.cell_count());
      if (world.hover.safe(v)) return v;
    }
  };
  std::size_t exists = 0, found = 0;
  std::string failures;
  for (std::size_t n = 0; n < count; ++n) {
    const Index3 from = draw(), to = draw();
    const Vec3 start = world.grid.center(from), goal = world.grid.center(to);
    const Plan p = plan(world, {{start, Vec3::Zero()}, {start, Vec3::Zero(), Vec3::Zero(), 0}}, goal, {1.5, 2});
    if (!joined(world, from)[world.grid.linear(to)]) {
      EXPECT_EQ(p.status, PlanStatus::no_path);
      continue;
    }
    exists += 1;
    found += p.status == PlanStatus::ok;
    if (p.status != PlanStatus::ok) failures.append("\n").append(to_string(p.status)).append(": ").append(p.message);
  }
  EXPECT_GT(exists, count / 2);
  EXPECT_GE(static_cast<double>(found), 0.99 * static_cast<double>(exists)) << found << " of " << exists << failures;
}

TEST(Success, InTheFurnishedApartmentAWayIsFoundWhereverOneExists) {
  const auto world =
      build_world(map::builtin_scene("apartment").value(), config::load_model("builtin:quad-5in").value(),
                  config::load_vehicle("builtin:quad-5in").value());
  expect_success(*world, 100, 1);
}

TEST(Success, InClutterAWayIsFoundThroughNarrowPassages) {
  map::OccupancyGrid grid({0, 0, 0}, 0.1, {60, 60, 20}, map::Cell::free);
  std::mt19937_64 random(5);
  for (int n = 0; n < 45; ++n) {
    const Index3 low(static_cast<int>(random() % 57), static_cast<int>(random() % 57), static_cast<int>(random() % 12));
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        for (int k = 0; k < 8; ++k) grid.set(low + Index3(i, j, k), map::Cell::occupied);
  }
  const auto world = build_world(grid, config::load_model("builtin:quad-5in").value(),
                                 config::load_vehicle("builtin:quad-5in").value());
  expect_success(*world, 100, 2);
}

}  // namespace
}  // namespace backwash::plan
