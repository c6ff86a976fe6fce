// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "tests/daemon/map/map_window_rig.hpp"

// docs/interfaces.md, "A window that moves": whose word counts, of scans, clouds and maps in any order.
namespace backwash::daemon {
namespace {

using map::Cell;

TEST_F(MapWindowTest, WhatAScanHasFoundMeanwhileIsNotLetGoWithThePart) {
  begin(with_window(0));
  whole(grid_);
  const Vec3 far(-2.5, 0.1, 1.1);
  vehicle({-2.3, 0.5, 1.1});
  say(true, 5, [&](const Vec3& p) { return same_voxel(p, far); });
  EXPECT_TRUE(channels_->scans.push(new Scan{{far}, {-1.5, 0.1, 1.1}, 6}));
  step();
  ASSERT_EQ(at(far), Cell::occupied);
  vehicle({2.3, 0.5, 1.1});
  say(false, 8, [](const Vec3&) { return false; });
  EXPECT_EQ(at(far), Cell::occupied);
}

TEST_F(MapWindowTest, WhatAScanHasFoundTooIsNotLetGoAsTheWindowsAlone) {
  for (const bool scan_first : {false, true}) {
    begin(with_window(0));
    whole(grid_);
    const Vec3 far(-2.5, 0.1, 1.1);
    vehicle({-2.3, 0.5, 1.1});
    const auto scanned = [&] {
      EXPECT_TRUE(channels_->scans.push(new Scan{{far}, {-1.5, 0.1, 1.1}, 6}));
      step();
    };
    if (scan_first) scanned();
    say(false, 5, [&](const Vec3& p) { return same_voxel(p, far); });
    if (!scan_first) scanned();
    vehicle({2.3, 0.5, 1.1});
    say(false, 8, [](const Vec3&) { return false; });
    EXPECT_EQ(at(far), Cell::occupied) << scan_first;
  }
}

TEST_F(MapWindowTest, WhatScansHaveFreedIsOccupiedAgainOnceTheWindowListsItAgain) {
  begin(with_window(100));
  whole(grid_);
  vehicle({0, 0.5, 1.1});
  const auto seen = [](const Vec3& p) { return same_voxel(p, kSeenAt); };
  say(false, 5, seen);
  for (int n = 0; n < 5; ++n) look_through(6 + n);
  step();
  ASSERT_EQ(at(kSeenAt), Cell::free) << "five scans look through it";
  say(false, 12, seen);
  EXPECT_EQ(at(kSeenAt), Cell::occupied);
  expect_as_built();
  for (int n = 0; n < 4; ++n) look_through(13 + n);
  say(false, 17, seen);
  look_through(18);
  step();
  EXPECT_EQ(at(kSeenAt), Cell::occupied) << "scans count from the cloud on";
}

TEST_F(MapWindowTest, ScansAndCloudsThatWaitedAreTakenInTheOrderInWhichTheyCame) {
  begin(with_window(100));
  whole(grid_);
  vehicle({0, 0.5, 1.1});
  const auto seen = [](const Vec3& p) { return same_voxel(p, kSeenAt); };
  waits_ = true;
  say(true, 5, seen);
  EXPECT_TRUE(channels_->scans.push(new Scan{{kSeenAt}, {-0.5, 0.1, 1.1}, 6}));
  step();
  EXPECT_EQ(at(kSeenAt), Cell::occupied) << "the scan is newer than the cloud of free voxels";
  EXPECT_EQ(channels_->map_ns.load(), 6);
  for (int n = 0; n < 5; ++n) look_through(7 + n);
  say(false, 12, seen);
  step();
  EXPECT_EQ(at(kSeenAt), Cell::occupied) << "the cloud is newer than the scans";
  EXPECT_EQ(channels_->map_ns.load(), 12);
  say(false, 13, [](const Vec3&) { return false; });
  EXPECT_TRUE(channels_->scans.push(new Scan{{{0.9, 0.1, 1.1}}, {-0.5, 0.1, 1.1}, 14}));
  step();
  EXPECT_EQ(channels_->map_ns.load(), 14) << "an older cloud makes no scan older";
  expect_as_built();
}

TEST_F(MapWindowTest, AMapperThatBeganAnewFreesByItsOwnStamps) {
  begin(with_window(100));
  whole(grid_);
  vehicle({0, 0.5, 1.1});
  const auto seen = [](const Vec3& p) { return same_voxel(p, kSeenAt); };
  say(false, 1000, seen);
  say(
      false, 3, [](const Vec3&) { return false; }, true);
  say(true, 4, seen);
  EXPECT_EQ(at(kSeenAt), Cell::free);
}

TEST_F(MapWindowTest, WhatAScanHasFoundTooIsTakenAlongAsSuch) {
  begin(with_window(0));
  vehicle({0, 0, 1});
  const Vec3 found(-0.5, 0.1, 1.1);
  say(true, 1, [](const Vec3&) { return true; });
  say(false, 2, [&](const Vec3& p) { return same_voxel(p, found); });
  EXPECT_TRUE(channels_->scans.push(new Scan{{found}, {0.3, 0.1, 1.1}, 3}));
  step();
  vehicle({0.9, 0, 1});  // the world moves, and the part is let go of in it
  say(false, 4, [](const Vec3&) { return false; });
  const Vec3 moved = world()->grid.origin();
  ASSERT_EQ(at(found), Cell::occupied);
  vehicle({1.0, 0, 1});
  say(false, 5, [](const Vec3&) { return false; });
  EXPECT_EQ(world()->grid.origin(), moved);
  EXPECT_EQ(at(found), Cell::occupied);
}

TEST_F(MapWindowTest, AMapThatWaitsForOdometryIsNotMixedWithTheWorldBeforeIt) {
  begin(with_window(0, (15 * 15 * 15 * 115.0 + static_cast<double>(grid_.cell_count())) / (1 << 20) + 0.01));
  map::OccupancyGrid before({-1, -1, 0}, 0.2, {10, 10, 10}, Cell::occupied);
  before.set({0, 0, 0}, Cell::free);
  whole(before);
  ASSERT_EQ(world()->grid.size(), before.size());
  whole(grid_, 2);
  vehicle({0, 0.1, 1.1});
  say(false, 3, [](const Vec3&) { return false; });
  ASSERT_EQ(world()->grid.size(), Index3(15, 15, 15));
  map::for_each_voxel(map::all_of(world()->grid.size()), [&](const Index3& v) {
    ASSERT_EQ(world()->grid.at(v), grid_.at(grid_.index(world()->grid.center(v))));
  });
}

}  // namespace
}  // namespace backwash::daemon
