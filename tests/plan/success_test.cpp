// SPDX-License-Identifier: BSD-3-Clause
// Success where a path exists: an exhaustive search of the grid under the same hover map is the judge. The full count
// is bench_plan's `success`.
#include <gtest/gtest.h>

#include <queue>
#include <random>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/planner.hpp"

namespace backwash::plan {
namespace {

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
