// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/plan_along.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/feasibility.hpp"
#include "core/plan/rest.hpp"
#include "tests/plan/drawn.hpp"

namespace backwash::plan {
namespace {

const Vehicle kFlown = config::load_vehicle("builtin:quad-5in").value();
const Model kBlown = config::load_model("builtin:quad-5in").value();
constexpr PlanOptions kAlongLimits{1.5, 2};

PlanStart resting_at(const Vec3& p_W) { return {{p_W, Vec3::Zero()}, {p_W, Vec3::Zero(), Vec3::Zero(), 0}}; }

/// Worlds of parts of a map, and how many of its voxels were asked for.
struct MadeWorlds {
  std::vector<std::size_t> free{};
  std::shared_ptr<const World> operator()(map::OccupancyGrid part, const map::OccupancyGrid* around) {
    free.push_back(static_cast<std::size_t>(std::ranges::count(part.cells(), map::Cell::free)));
    const map::VoxelBox all = map::all_of(part.size());
    return rebuilt(unbuilt_world(std::move(part), kBlown, kFlown), {.voxels = all, .around = around});
  }
};

Plan planned_along(const map::OccupancyGrid& grid, const Vec3& start_W, const Vec3& goal_W, MadeWorlds& made) {
  return plan_along(grid, kBlown, kFlown, std::ref(made), resting_at(start_W), goal_W, kAlongLimits);
}

/// Centres of hover-safe voxels, drawn: of the largest region, the last two of any.
std::vector<Vec3> safe_places(const World& world, std::size_t count) {
  const Regions regions = hover_regions(world);
  std::vector<Vec3> joined, any, drawn;
  for (std::size_t n = 0; n < world.grid.cell_count(); ++n) {
    if (!regions.of_voxel[n]) continue;
    any.push_back(world.grid.center(world.grid.voxel(n)));
    if (regions.of_voxel[n] == 0U) joined.push_back(any.back());
  }
  std::mt19937 random(3);
  while (drawn.size() < count) {
    const auto& from = drawn.size() + 2 < count ? joined : any;
    drawn.push_back(from[random() % from.size()]);
  }
  return drawn;
}

/// Two rooms of 6 × 4 × 1.6 m behind each other; in the wall between them a gap from y = `gap` on.
map::OccupancyGrid two_rooms(double gap) {
  map::OccupancyGrid grid({-0.1, -0.1, -0.1}, 0.1, {122, 42, 18}, map::Cell::occupied);
  fill(grid, {0, 0, 0}, {12, 4, 1.6}, map::Cell::free);
  if (gap > 0) fill(grid, {6, 0, 0}, {6.1, gap, 1.6}, map::Cell::occupied);
  return grid;
}

class PlanAlong : public testing::TestWithParam<const char*> {};

TEST_P(PlanAlong, IsVerifiedInTheWholeWorldByTheSameTubeAndMissesNoPlan) {
  const auto grid = map::load_map(GetParam()).value();
  const auto whole = build_world(grid, kBlown, kFlown);
  const auto ends = safe_places(*whole, grid.cell_count() > 1'000'000 ? 8 : 24);
  std::size_t found = 0, parts = 0;
  double time = 0, time_in_whole = 0;
  for (std::size_t n = 0; n + 1 < ends.size(); n += 2) {
    SCOPED_TRACE(testing::Message() << ends[n].transpose() << " to " << ends[n + 1].transpose());
    MadeWorlds made;
    const Plan along = planned_along(grid, ends[n], ends[n + 1], made);
    const Plan in_whole = plan(*whole, resting_at(ends[n]), ends[n + 1], kAlongLimits);
    ASSERT_EQ(to_string(along.status), std::string(to_string(in_whole.status))) << along.message;
    parts += made.free.back() < static_cast<std::size_t>(std::ranges::count(grid.cells(), map::Cell::free));
    if (along.status != PlanStatus::ok) continue;
    const PlanStart start = resting_at(ends[n]);
    const auto tube = tube_to_rest(*whole, start.estimated, start.command, along.commands);
    ASSERT_EQ(tube.size(), along.tube.size());
    for (std::size_t k = 0; k < tube.size(); ++k) {
      ASSERT_LT((tube[k].center.p_W - along.tube[k].center.p_W).norm(), 1e-9);
      for (std::size_t d = 0; d < kDirections; ++d) {
        ASSERT_NEAR(tube[k].half_widths[d], along.tube[k].half_widths[d], 1e-9) << k;
        ASSERT_NEAR(tube[k].half_widths_interval[d], along.tube[k].half_widths_interval[d], 1e-9) << k;
      }
    }
    ASSERT_GT(along.metrics.min_clearance_m, 0);
    ASSERT_NEAR(tube_clearance(*whole, tube), along.metrics.min_clearance_m, 1e-9);
    ++found;
    time += along.metrics.time_s;
    time_in_whole += in_whole.metrics.time_s;
  }
  EXPECT_GT(found, 2u);
  EXPECT_GT(parts, 2u);
  EXPECT_LT(time, 1.1 * time_in_whole);
}
INSTANTIATE_TEST_SUITE_P(Maps, PlanAlong,
                         testing::Values("builtin:apartment", "builtin:corridors", "builtin:thin-wall",
                                         "builtin:forest-0", BACKWASH_SOURCE_DIR "/tests/data/maps/geb079.bt"));

TEST(PlanAlong, MakesAFewMetresOfALargeMap) {
  const auto grid = map::load_map(BACKWASH_SOURCE_DIR "/tests/data/maps/geb079.bt").value();
  MadeWorlds made;
  const Plan plan = planned_along(grid, {26, 0.1, 1.08}, {16, -0.9, 1.08}, made);
  ASSERT_EQ(plan.status, PlanStatus::ok) << plan.message;
  EXPECT_EQ(made.free.size(), 1u);
  EXPECT_LT(made.free.front(), static_cast<std::size_t>(std::ranges::count(grid.cells(), map::Cell::free)) / 3);
}

// The way over free places leads through a gap that no set fits; the way about the wall is found all the same.
TEST(PlanAlong, LooksFurtherWhereItsWayIsNotSafe) {
  map::OccupancyGrid grid = two_rooms(3.0);
  fill(grid, {6, 0.7, 0}, {6.1, 1.3, 1.6}, map::Cell::free);
  MadeWorlds made;
  const Plan plan = planned_along(grid, {4.55, 1.05, 0.85}, {7.55, 1.05, 0.85}, made);
  ASSERT_EQ(plan.status, PlanStatus::ok) << plan.message;
  EXPECT_GT(made.free.size(), 1u);
  EXPECT_GT(plan.metrics.length_m, 4.5);
}

TEST(PlanAlong, SaysNoPathOnlyWhereTheWholeMapHasNone) {
  MadeWorlds behind_a_wall, through_a_slit;
  EXPECT_EQ(planned_along(two_rooms(4.0), {1.05, 1.05, 0.85}, {11.05, 1.05, 0.85}, behind_a_wall).status,
            PlanStatus::no_path);
  EXPECT_EQ(behind_a_wall.free.size(), 1u);
  // Free, and wide enough for the body alone.
  const Plan plan = planned_along(two_rooms(3.55), {1.05, 1.05, 0.85}, {11.05, 1.05, 0.85}, through_a_slit);
  EXPECT_EQ(plan.status, PlanStatus::no_path) << plan.message;
}

}  // namespace
}  // namespace backwash::plan
