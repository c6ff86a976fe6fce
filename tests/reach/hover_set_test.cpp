// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/hover_set.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "core/reach/clearance.hpp"
#include "tests/support/rounded_up.hpp"

namespace backwash::reach {
namespace {

Vehicle test_vehicle() {
  Vehicle vehicle;
  vehicle.body = {.radius = 0.16, .diagonal_radius = 0.18, .rotor_radius = 0.06, .mass = 0.8};
  vehicle.controller = {.kp = {6.0, 8.0}, .kd = {4.0, 5.0}, .latency = 0, .feedback_delay = 0, .attitude_lag = 0};
  vehicle.estimation.position = 0.02;
  return vehicle;
}

/// A room of 2.4 × 2.4 × 1.6 m: floor, one wall (y = 0), a pillar; the other sides end in the unknown.
map::OccupancyGrid room() {
  const Index3 size(24, 24, 16);
  map::OccupancyGrid grid(Vec3::Zero(), 0.1, size, map::Cell::free);
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const Index3 v = grid.voxel(n);
    const bool pillar = (v.head<2>().array() - 16).abs().maxCoeff() <= 1;
    if (v.z() == 0 || v.y() == 0 || pillar) grid.set(v, map::Cell::occupied);
  }
  return grid;
}

Model with_kappa(double kappa) {
  Model model;
  model.bound.kappa = kappa;
  return model;
}

struct HoverScene {
  map::OccupancyGrid grid;
  map::DistanceField distance;
  field::DisturbanceField field;
  Model model;
  BoundField bounds;
};

/// The field is stored in every free voxel, so that only the model decides what is near an obstacle.
HoverScene make_scene(const Model& model) {
  map::OccupancyGrid grid = room();
  std::vector<std::size_t> voxels;
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    if (grid.at(n) == map::Cell::free) voxels.push_back(n);
  }
  field::DisturbanceField field(grid, voxels);
  field.fill(field::ProximityField(grid, model), voxels);
  map::DistanceField distance(grid);
  BoundField bounds(grid, field, model.bound);
  return {std::move(grid), std::move(distance), std::move(field), model, std::move(bounds)};
}

std::vector<Vec3> random_points(const map::OccupancyGrid& grid, std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  std::vector<Vec3> points;
  while (points.size() < count) {
    const Vec3 p = grid.origin() +
                   grid.resolution() * grid.size().cast<double>().cwiseProduct(Vec3(u(random), u(random), u(random)));
    if (grid.free(grid.index(p))) points.push_back(p);
  }
  return points;
}

double h_inf(const Reachability& reach, std::size_t d) {
  return d == kZ ? reach.vertical.h_inf : reach.horizontal.h_inf;
}

/// F(h) = h_∞ × max w̄ over the voxels that meet p ± h, by a loop over the whole grid.
PerDirection image(const HoverScene& scene, const Reachability& reach, const Vec3& p, const PerDirection& h) {
  PerDirection result{};
  const Vec3 reach_of_box = Vec3(h[kX], h[kY], h[kZ]) + Vec3::Constant(scene.grid.resolution() / 2);
  for (std::size_t n = 0; n < scene.grid.cell_count(); ++n) {
    const Index3 v = scene.grid.voxel(n);
    if (!scene.field.has(v) || ((scene.grid.center(v) - p).cwiseAbs().array() > reach_of_box.array()).any()) continue;
    const DisturbanceBound w = bound(scene.field.at(v), scene.model.bound);
    for (std::size_t d = 0; d < kDirections; ++d) result[d] = std::max(result[d], h_inf(reach, d) * rounded_up(w.w[d]));
  }
  return result;
}

/// The scene used by most claims; built once.
const HoverScene& default_scene() {
  static const HoverScene scene = make_scene(with_kappa(3));
  return scene;
}

TEST(HoverSet, IsAFixedPointOfTheWorstBoundOverItself) {
  const HoverScene& scene = default_scene();
  const Reachability reach(test_vehicle(), Method::tight, Loop::continuous);
  int grown = 0, bounded = 0;
  for (const Vec3& p : random_points(scene.grid, 300, 1)) {
    const HoverSet set = hover_set(reach, scene.grid, scene.distance, scene.bounds, p);
    if (!set.bounded) continue;
    ++bounded;
    const PerDirection expected = image(scene, reach, p, set.half_widths);
    for (std::size_t d = 0; d < kDirections; ++d) EXPECT_NEAR(set.half_widths[d], expected[d], 1e-6 * expected[d]);
    const DisturbanceBound at_center = scene.bounds.at(scene.grid.index(p));
    grown += set.half_widths[kY] > 1.001 * h_inf(reach, kY) * at_center.w[kY];
  }
  EXPECT_GT(bounded, 100);
  EXPECT_GT(grown, 50);  // elsewhere the set lies within one voxel and the claim is empty
}

// Tarski: the smallest fixed point lies below every h with F(h) ≤ h, so no such h lies below it.
TEST(HoverSet, IsTheSmallestFixedPoint) {
  const HoverScene& scene = default_scene();
  const Reachability reach(test_vehicle(), Method::tight, Loop::continuous);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> shrink(0.3, 0.999);
  for (const Vec3& p : random_points(scene.grid, 100, 3)) {
    const HoverSet set = hover_set(reach, scene.grid, scene.distance, scene.bounds, p);
    if (!set.bounded) continue;
    for (int trial = 0; trial < 10; ++trial) {
      PerDirection smaller = set.half_widths;
      for (double& h : smaller) h *= shrink(random);
      const PerDirection F = image(scene, reach, p, smaller);
      bool contained = true;
      for (std::size_t d = 0; d < kDirections; ++d) contained = contained && F[d] <= smaller[d];
      EXPECT_FALSE(contained);
    }
  }
}

TEST(HoverSet, GrowsWithTheDisturbance) {
  const HoverScene& weak = default_scene();
  const HoverScene strong = make_scene(with_kappa(4));
  const Reachability reach(test_vehicle(), Method::tight, Loop::continuous);
  for (const Vec3& p : random_points(weak.grid, 300, 4)) {
    const HoverSet small = hover_set(reach, weak.grid, weak.distance, weak.bounds, p);
    const HoverSet large = hover_set(reach, strong.grid, strong.distance, strong.bounds, p);
    EXPECT_TRUE(small.bounded || !large.bounded);
    if (!large.bounded) continue;
    EXPECT_LE(large.clearance, small.clearance);
    for (std::size_t d = 0; d < kDirections; ++d) EXPECT_GT(large.half_widths[d], small.half_widths[d]);
  }
}

TEST(HoverSet, IsUnboundedWhereTheFieldIsTooStrong) {
  const HoverScene scene = make_scene(with_kappa(200));
  const Reachability reach(test_vehicle(), Method::tight, Loop::continuous);
  const HoverSet at_wall = hover_set(reach, scene.grid, scene.distance, scene.bounds, Vec3(0.8, 0.35, 0.6));
  EXPECT_FALSE(at_wall.bounded);
  EXPECT_FALSE(at_wall.safe());
  EXPECT_LT(at_wall.clearance, 0);
}

TEST(HoverSet, ClearanceIsTheDistanceOfThePrismLessBodyAndEstimation) {
  const HoverScene& scene = default_scene();
  const Reachability reach(test_vehicle(), Method::tight, Loop::continuous);
  int positive = 0;
  for (const Vec3& p : random_points(scene.grid, 300, 5)) {
    const HoverSet set = hover_set(reach, scene.grid, scene.distance, scene.bounds, p);
    if (!set.bounded) continue;
    const double expected = std::min(1.0, prism_distance(scene.grid, p, set.half_widths, 1e3) - 0.16 - 0.02);
    EXPECT_NEAR(set.clearance, expected, 1e-9);
    EXPECT_EQ(set.safe(), expected > 0);
    positive += expected > 0;
  }
  EXPECT_GT(positive, 30);
}

// Without a disturbance the set is a point; with the base variance alone it is small and the same everywhere.
TEST(HoverSet, ClearanceInTheOpenIsExactUpToItsCapOfOneMetre) {
  const map::OccupancyGrid grid(Vec3::Zero(), 0.2, Index3(20, 20, 20), map::Cell::free);
  const map::DistanceField distance(grid);
  const Reachability reach(test_vehicle(), Method::tight, Loop::continuous);
  std::vector<std::size_t> voxels(grid.cell_count());
  std::iota(voxels.begin(), voxels.end(), 0u);
  field::DisturbanceField field(grid, voxels);
  field.fill(field::ProximityField(grid, Model{}), voxels);
  int capped = 0, near_cap = 0;
  for (const double kappa : {0.0, 3.0}) {
    const BoundField bounds(grid, field, BoundModel{kappa, 0, 0, 0.15});
    for (const Vec3& p : random_points(grid, 1000, 8)) {
      const HoverSet set = hover_set(reach, grid, distance, bounds, p);
      const Vec3 h(set.half_widths[kX], set.half_widths[kY], set.half_widths[kZ]);
      const double to_sides = (p.cwiseMin(Vec3::Constant(4) - p) - h).minCoeff();
      EXPECT_NEAR(set.clearance, std::min(1.0, std::max(0.0, to_sides) - 0.16 - 0.02), 1e-9);
      capped += to_sides > 1.18;
      near_cap += to_sides > 1.0 && to_sides < 1.18;
    }
  }
  EXPECT_GT(capped, 50);
  EXPECT_GT(near_cap, 50);
}

TEST(HoverSet, IsNeverSafeOutsideFreeSpace) {
  const HoverScene& scene = default_scene();
  const Reachability reach(test_vehicle(), Method::tight, Loop::continuous);
  for (const Vec3& p : {Vec3(-1, 1, 1), Vec3(1, 1, 1.7), Vec3(1, 1, 0.05), Vec3(1, 0.05, 1)}) {
    for (const auto margin : {std::optional<double>(), std::optional(0.0)}) {
      const HoverSet set = hover_set(reach, scene.grid, scene.distance, scene.bounds, p, margin);
      EXPECT_FALSE(set.safe());
      EXPECT_LT(set.clearance, 0);
    }
  }
}

TEST(HoverSet, ConstantMarginReplacesTheExtentAndNothingElse) {
  const HoverScene& scene = default_scene();
  const Reachability reach(test_vehicle(), Method::tight, Loop::continuous);
  for (const Vec3& p : random_points(scene.grid, 200, 6)) {
    double nearest = p.cwiseMin(Vec3(2.4, 2.4, 1.6) - p).minCoeff();
    for (std::size_t n = 0; n < scene.grid.cell_count(); ++n) {
      if (scene.grid.at(n) == map::Cell::free) continue;
      const Vec3 gap = (p - scene.grid.center(scene.grid.voxel(n))).cwiseAbs() - Vec3::Constant(0.05);
      nearest = std::min(nearest, gap.cwiseMax(0.0).norm());
    }
    const HoverSet set = hover_set(reach, scene.grid, scene.distance, scene.bounds, p, 0.1);
    EXPECT_NEAR(set.clearance, nearest - 0.1 - 0.16 - 0.02, 1e-9);
  }
}

/// The bounds of a scene where the same mean push acts everywhere.
BoundField pushed(const HoverScene& scene, const Vec3& push_W) {
  Model model = scene.model;
  model.extension = {{Law::push, push_W, Vec3::Zero(), 0}};
  return {scene.grid, scene.field, model.bound, field::Extension(scene.grid, model)};
}

TEST(HoverSet, OfAPushedVehicleIsJudgedWhereThePushHoldsIt) {
  const HoverScene& scene = default_scene();
  const Reachability reach(test_vehicle(), Method::tight, Loop::continuous);
  const Vec3 push(0, -1.2, 0.8), shift = push.cwiseQuotient(Vec3(6, 6, 8));
  const BoundField bounds = pushed(scene, push);
  int into_obstacles = 0, judged = 0;
  for (const Vec3& p : random_points(scene.grid, 500, 9)) {
    const HoverSet set = hover_set(reach, scene.grid, scene.distance, bounds, p);
    const Vec3 c = p + shift;
    if (!scene.grid.free(scene.grid.index(c))) {
      EXPECT_FALSE(set.bounded) << p.transpose();
      ++into_obstacles;
    } else if (set.bounded) {
      EXPECT_NEAR(set.clearance, std::min(1.0, prism_distance(scene.grid, c, set.half_widths, 1e3) - 0.16 - 0.02),
                  1e-9);
      ++judged;
    }
  }
  EXPECT_GT(into_obstacles, 30);
  EXPECT_GT(judged, 100);
}

TEST(HoverSet, IsNotSafeInAnObstacleThatThePushWouldTakeTheVehicleOutOf) {
  const HoverScene& scene = default_scene();
  const Reachability reach(test_vehicle(), Method::tight, Loop::continuous);
  const BoundField bounds = pushed(scene, Vec3(0, 6 * 0.9, 0));
  const Vec3 in_wall(0.85, 0.05, 0.75);
  ASSERT_TRUE(hover_set(reach, scene.grid, scene.distance, scene.bounds, in_wall + Vec3(0, 0.9, 0)).safe());
  EXPECT_FALSE(hover_set(reach, scene.grid, scene.distance, bounds, in_wall).bounded);
  EXPECT_FALSE(hover_set(reach, scene.grid, scene.distance, bounds, in_wall, 0.05).bounded);
}

TEST(HoverSet, OfThePaperContainsTheTightOneAlongTheAxes) {
  const HoverScene scene = make_scene(with_kappa(1.5));  // the paper's larger sets must fit as well
  const Reachability tight(test_vehicle(), Method::tight, Loop::continuous);
  const Reachability paper(test_vehicle(), Method::paper, Loop::continuous);
  int compared = 0;
  for (const Vec3& p : random_points(scene.grid, 200, 7)) {
    const HoverSet inner = hover_set(tight, scene.grid, scene.distance, scene.bounds, p);
    const HoverSet outer = hover_set(paper, scene.grid, scene.distance, scene.bounds, p);
    EXPECT_TRUE(inner.bounded || !outer.bounded);
    if (!outer.bounded) continue;
    for (const Direction d : {kX, kY, kZ}) EXPECT_GE(outer.half_widths[d], inner.half_widths[d]);
    ++compared;
  }
  EXPECT_GT(compared, 50);
}

}  // namespace
}  // namespace backwash::reach
