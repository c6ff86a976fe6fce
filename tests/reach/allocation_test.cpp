// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

#include "core/field/disturbance_field.hpp"
#include "core/reach/bound/bound_field.hpp"
#include "core/reach/clearance.hpp"
#include "core/reach/ellipsoid.hpp"
#include "core/reach/support.hpp"

namespace {
thread_local std::size_t allocations = 0;
}

void* operator new(std::size_t size) {
  ++allocations;
  if (void* p = std::malloc(size > 0 ? size : 1)) return p;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(size > 0 ? size : 1);
}
[[gnu::noinline]] void operator delete(void* p) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept { std::free(p); }

namespace backwash::reach {
namespace {

TEST(RealTime, StepsOfCentreAndSetsDoNotAllocate) {
  Vehicle vehicle;
  vehicle.controller.kp = {20, 20};
  vehicle.controller.kd = {4, 4};
  vehicle.controller.latency = 0.033;
  vehicle.controller.feedback_delay = 0.0124;
  vehicle.controller.attitude_lag = 0.05;
  const AxisResponse response = axis_response(axis_loop(vehicle, false, Loop::vehicle), Loop::vehicle);
  SupportRecursion support(response, response, vehicle);
  EllipsoidRecursion ellipsoid(vehicle);
  CentrePredictor delayed(vehicle, Loop::vehicle, {}, Vec3::Zero(), {});
  CentrePredictor sampled(vehicle, Loop::sampled, {}, Vec3::Zero(), {});
  const DisturbanceBound bound{{1, 1, 1, 1, 1}};
  const std::size_t before = allocations;
  EXPECT_GT(before, 0u);  // the counter counts
  for (std::size_t k = 0; k < 3 * response.G.size(); ++k) {
    support.step(bound);
    ellipsoid.step(Vec3::Ones());
    delayed.step(Setpoint{});
    sampled.step(Setpoint{});
    support.half_widths_until_next(bound);
  }
  EXPECT_EQ(allocations, before);
}

TEST(RealTime, PushesAndBoundsOfAnExtendedModelDoNotAllocate) {
  map::OccupancyGrid grid(Vec3::Zero(), 0.1, Index3(12, 12, 12), map::Cell::free);
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j) {
      grid.set({i, j, 11}, map::Cell::occupied);
      grid.set({i, 0, j}, map::Cell::occupied);
    }
  std::vector<std::size_t> voxels;
  for (std::size_t n = 0; n < grid.cell_count(); ++n)
    if (grid.at(n) == map::Cell::free) voxels.push_back(n);
  Model model;
  model.extension = {{Law::push_under_surface, Vec3(0.3, 0, 0), Vec3::Zero(), 0.2},
                     {Law::push_to_walls, Vec3(0.3, 0, 0), Vec3::Zero(), 0.2},
                     {Law::ln_variance_with_speed, Vec3(0.5, 0, 0), Vec3::Zero(), 2}};
  field::DisturbanceField field(grid, voxels);
  field.fill(field::ProximityField(grid, model), voxels);
  field::Extension extension(grid, model);
  extension.fill(grid, voxels);
  const BoundField bounds(grid, field, model.bound, std::move(extension));
  const std::size_t before = allocations;
  Vec3 sum = Vec3::Zero();
  double widest = 0;
  for (int n = 0; n < 20; ++n) {
    const Vec3 p = Vec3::Constant(0.06 * n), v(0.1 * n, 0, 0);
    const Vec3 push = bounds.push(p, v);
    sum += push;
    widest = std::max(widest, bounds.max_about(push, v, p - Vec3::Constant(0.2), p + Vec3::Constant(0.2)).w[kZ]);
  }
  EXPECT_EQ(allocations, before);
  EXPECT_GT(sum.z(), 0);
  EXPECT_GT(widest, 0);
}

TEST(RealTime, TestingATubeAgainstANewVoxelDoesNotAllocate) {
  const ReachTube tube(20);
  const std::size_t before = allocations;
  for (int n = 0; n < 10; ++n) EXPECT_EQ(first_blocked(tube, 0, {Vec3::Constant(0.1 * n), 0.1}, 0.2) == 0, n < 2);
  EXPECT_EQ(allocations, before);
}

}  // namespace
}  // namespace backwash::reach