// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "core/config/config.hpp"
#include "core/plan/world/world.hpp"

namespace backwash::plan {
namespace {

// What an integrator holds may have blown anywhere: rougher air at one end of a hall takes hover places at the other.
TEST(World, WithAnIntegratorUpdatedByRegionIsTheWorldBuiltAnew) {
  Vehicle vehicle = config::load_vehicle("builtin:quad-5in").value();
  vehicle.controller.velocity_integrator = {0.4, 0.4};
  map::OccupancyGrid hall(Vec3::Zero(), 0.1, Index3(140, 24, 20), map::Cell::free);
  for (int j = 0; j < 24; ++j)
    for (int i = 0; i < 140; ++i) hall.set({i, j, 0}, map::Cell::occupied);
  map::OccupancyGrid grid = hall;
  map::VoxelBox changed;
  for (int k = 1; k < 20; ++k)
    for (int n = 0; n < 8; ++n)
      for (const Index3& v : {Index3(125 + n, 8, k), Index3(125 + n, 16, k), Index3(133, 8 + n, k)}) {
        grid.set(v, map::Cell::occupied);
        changed.add(v);
      }
  const auto before = build_world(hall, Model{}, vehicle), anew = build_world(grid, Model{}, vehicle);
  const auto there = rebuilt(*before, {.grid = grid, .voxels = changed}),
             back = rebuilt(*there, {.grid = hall, .voxels = changed});
  int far = 0, safe = 0;
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const Index3 v = grid.voxel(n);
    ASSERT_EQ(there->hover.safe(v), anew->hover.safe(v)) << v.transpose();
    ASSERT_EQ(back->hover.safe(v), before->hover.safe(v)) << v.transpose();
    far += v.x() < 60 && before->hover.safe(v) && !anew->hover.safe(v);
    safe += anew->hover.safe(v);
  }
  EXPECT_GT(far, 10);
  EXPECT_GT(safe, 1000);
}

}  // namespace
}  // namespace backwash::plan
