// SPDX-License-Identifier: BSD-3-Clause
// What a map, a scan or a window says is not free any more, before a world is made of it (docs/faults.md row 14).
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "services/backwashd/channels.hpp"
#include "tests/daemon/map/map_window_rig.hpp"

namespace backwash::daemon {
namespace {

using map::Cell;
using map::OccupancyGrid;

/// All that control was told since.
std::vector<NewVoxels> told(Channels& channels) {
  std::vector<NewVoxels> all;
  while (const auto voxels = channels.map_voxels.pop()) all.push_back(*voxels);
  return all;
}
bool holds(const std::vector<NewVoxels>& told, const Vec3& p) {
  return std::ranges::any_of(told, [&](const NewVoxels& voxels) { return holds(voxels, p); });
}

// A snapshot's time says which records a flight that was verified in it need not be held against.
TEST_F(MapWorkerTest, AMapThatIsNewerThanAScanHoldsWhatTheScanHasFound) {
  const Vec3 sensor(0.1, 0.1, 1.1), early(1.1, 0.1, 1.1), waits(-1.1, 0.1, 1.1);
  send(grid_);
  scan({early}, sensor, 5);
  EXPECT_TRUE(channels_->scans.push(new Scan{{waits}, sensor, 8}));
  send(grid_, 9);
  for (const Vec3& p : {early, waits}) EXPECT_TRUE(world()->grid.occupied(grid_.index(p))) << p.transpose();
  EXPECT_EQ(held_->seen_ns, 9);
  for (int n = 0; n < 5; ++n) scan({{1.9, 0.1, 1.1}}, sensor, 10 + n);
  EXPECT_TRUE(world()->grid.free(grid_.index(early))) << "scans see through it";
  EXPECT_EQ(held_->seen_ns, 14);
}

TEST_F(MapWorkerTest, AMapTakesBackWhatScansFoundBeforeALoopClosure) {
  const Vec3 sensor(0.1, 0.1, 1.1), before(1.1, 0.1, 1.1), after(-1.1, 0.1, 1.1);
  send(grid_);
  scan({before}, sensor, 5);
  EXPECT_TRUE(channels_->scans.push(new Scan{{after}, sensor, 6, 1}));
  send(grid_, 9);
  EXPECT_TRUE(world()->grid.free(grid_.index(before)));
  EXPECT_TRUE(world()->grid.occupied(grid_.index(after)));
}

// The world in use says 11, and a flight that was verified in it is not held against what is older.
TEST_F(MapWorkerTest, AMapOfBeforeAScanThatWasTakenFirstIsToldAsNewerThanTheWorldThatLacksIt) {
  const Vec3 obstacle(1.1, 0.1, 1.1);
  OccupancyGrid blocked = grid_;
  blocked.set(grid_.index(obstacle), Cell::occupied);
  send(grid_);
  scan({{-1.1, 0.1, 1.1}}, {0.1, 0.1, 1.1}, 11);
  told(*channels_);
  channels_->stop = true;  // no world is made any more
  send(blocked, 10);
  const auto news = told(*channels_);
  ASSERT_TRUE(holds(news, obstacle));
  for (const NewVoxels& voxels : news) EXPECT_TRUE(voxels.received_ns > 11 || !holds(voxels, obstacle));
}

// More than a ring holds: what is heard at once is one record, and none is lost.
TEST_F(MapWorkerTest, ScansThatWaitedTogetherAreToldTogether) {
  send(grid_);
  const std::uint64_t lost = channels_->map_voxels.lost();
  for (int n = 0; n < 14; ++n)
    EXPECT_TRUE(channels_->scans.push(new Scan{{{-1.3 + 0.2 * n, 0.5, 1.1}}, {0.1, 0.1, 1.1}, 10 + n}));
  EXPECT_TRUE(worker_.step());
  EXPECT_EQ(channels_->map_voxels.lost(), lost);
  const auto all = told(*channels_);
  for (int n = 0; n < 14; ++n) EXPECT_TRUE(holds(all, {-1.3 + 0.2 * n, 0.5, 1.1})) << n;
}

TEST_F(MapWorkerTest, ASnapshotIsAsYoungAsTheScanThatFindsNothingNewInIt) {
  send(grid_);
  scan({{1.1, 0.1, 1.1}}, {0.1, 0.1, 1.1}, 5);
  scan({{1.1, 0.1, 1.1}}, {0.1, 0.1, 1.1}, 6);
  ASSERT_TRUE(world());
  EXPECT_EQ(held_->seen_ns, 6);
}

TEST_F(MapWorkerTest, WhatComesWhileAWorldIsMadeIsToldMeanwhileAndIsInTheNext) {
  send(grid_);
  ASSERT_TRUE(world());
  ASSERT_TRUE(channels_->map_writer.read_new());
  // A building: its world takes a hundred times as long as the next map is read in.
  const OccupancyGrid large(grid_.origin() - Vec3(10, 10, 0), 0.2, grid_.size() + Index3(150, 150, 5), Cell::free);
  const Vec3 scanned(1.1, 0.1, 1.1), mapped(-1.1, 0.1, 1.1);
  OccupancyGrid next = grid_;
  next.set(grid_.index(mapped), Cell::occupied);
  channels_->maps.offer(
      std::make_unique<const MapMessage>(MapMessage{map::encode_octomap(large), 0.2, true, "OcTree", 2}));
  std::thread maker([&] { worker_.step(); });
  const auto until = std::chrono::steady_clock::now() + std::chrono::minutes(5);
  while (!channels_->map_writer.read_new() && std::chrono::steady_clock::now() < until) std::this_thread::yield();
  EXPECT_TRUE(channels_->scans.push(new Scan{{scanned}, {0.1, 0.1, 1.1}, 3}));
  channels_->maps.offer(
      std::make_unique<const MapMessage>(MapMessage{map::encode_octomap(next), 0.2, true, "OcTree", 4}));
  std::vector<NewVoxels> all;
  while (!(holds(all, scanned) && holds(all, mapped)) && std::chrono::steady_clock::now() < until)
    for (const NewVoxels& voxels : told(*channels_)) all.push_back(voxels);
  EXPECT_EQ(channels_->maps_accepted, 1u) << "the large one is still in the making";
  maker.join();
  EXPECT_TRUE(holds(all, scanned));
  EXPECT_TRUE(holds(all, mapped));
  EXPECT_TRUE(worker_.step());
  for (const Vec3& p : {scanned, mapped}) EXPECT_TRUE(world()->grid.occupied(world()->grid.index(p)));
  EXPECT_EQ(held_->seen_ns, 4);
}

// The world is not made: the daemon ends.
TEST_F(MapWindowTest, WhatAWorldThatMovesLeavesBehindIsToldBeforeItIsMade) {
  begin(with_window(100));
  vehicle({0, 0, 1});
  say(true, 1, [](const Vec3&) { return true; });
  say(false, 2, [](const Vec3&) { return false; });
  ASSERT_TRUE(world());
  vehicle({0.9, 0, 1});
  channels_->stop = true;
  say(false, 3, [](const Vec3& p) { return same_voxel(p, {0.9, 0.1, 1.1}); });
  const auto news = told(*channels_);
  EXPECT_TRUE(holds(news, {0.9, 0.1, 1.1})) << "the crate";
  EXPECT_TRUE(holds(news, {-0.9, 0.1, 1.1})) << "outside of the world that comes";
  EXPECT_FALSE(holds(news, {0.1, 0.1, 1.1}));
}

TEST_F(MapWindowTest, WhatAWindowLetsGoIsToldWhereItIsNotFreeAnyMore) {
  begin(with_window(0));
  vehicle({0.6, 0, 1});
  say(true, 1, [](const Vec3&) { return true; });
  say(false, 2, [](const Vec3&) { return false; });
  ASSERT_EQ(at({-0.3, 0.1, 1.1}), Cell::free);
  vehicle({1.1, 0, 1});
  say(false, 3, [](const Vec3&) { return false; });
  ASSERT_EQ(at({-0.3, 0.1, 1.1}), Cell::unknown);
  EXPECT_TRUE(holds(told(*channels_), {-0.3, 0.1, 1.1}));
}

}  // namespace
}  // namespace backwash::daemon
