// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "tests/daemon/map/map_window_rig.hpp"

// docs/interfaces.md, "A window that moves": what the map worker makes of it.
namespace backwash::daemon {
namespace {

using map::Cell;

TEST_F(MapWindowTest, ItsVoxelsChangeTheWorldAsAScanDoesAndAgreeWithAWorldBuiltOfThem) {
  begin(with_window(100));
  whole(grid_);
  vehicle({0, 0.5, 1.1});
  ASSERT_EQ(at(kSeenAt), Cell::free);
  ASSERT_EQ(at(kWallAt), Cell::occupied);
  say(false, 5, [](const Vec3& p) { return same_voxel(p, kSeenAt); });
  EXPECT_EQ(at(kSeenAt), Cell::occupied);
  EXPECT_EQ(channels_->map_ns.load(), 5);
  const auto handed = channels_->map_voxels.pop();
  ASSERT_TRUE(handed) << "to the control thread, as of another map";
  EXPECT_EQ(handed->count, 1u);
  expect_as_built();
  // Not listed any more is not free; a cloud of free voxels says so.
  say(false, 6, [](const Vec3&) { return false; });
  EXPECT_EQ(at(kSeenAt), Cell::occupied);
  say(true, 7, [](const Vec3& p) { return same_voxel(p, kSeenAt) || same_voxel(p, kWallAt); });
  EXPECT_EQ(at(kSeenAt), Cell::free);
  EXPECT_EQ(at(kWallAt), Cell::free);
  EXPECT_EQ(channels_->map_ns.load(), 6) << "free voxels make no map younger";
  expect_as_built();
}

TEST_F(MapWindowTest, WhatItHasLeftStaysAsItWasSaidUntilItIsLetGoAndThenAsTheWholeMapHasIt) {
  begin(with_window(0));
  whole(grid_);
  const Vec3 far(-2.5, 0.1, 1.1), freed(-2.5, 1.1, 1.1);
  ASSERT_EQ(at(freed), Cell::occupied);
  vehicle({-2.3, 0.5, 1.1});
  say(false, 5, [&](const Vec3& p) { return same_voxel(p, far); });
  say(true, 6, [&](const Vec3& p) { return same_voxel(p, freed); });
  ASSERT_EQ(at(far), Cell::occupied);
  ASSERT_EQ(at(freed), Cell::free);
  // It moves by a metre: the part is still met. Then to the other end.
  vehicle({-1.3, 0.5, 1.1});
  say(false, 7, [](const Vec3&) { return false; });
  EXPECT_EQ(at(far), Cell::occupied);
  vehicle({2.3, 0.5, 1.1});
  say(false, 8, [](const Vec3&) { return false; });
  EXPECT_EQ(at(far), Cell::free) << "the whole map's";
  EXPECT_EQ(at(freed), Cell::occupied) << "the whole map's";
  expect_as_built();
  EXPECT_EQ(channels_->map_voxels.pop()->count, 1u) << "the obstacle, when it was seen";
  ASSERT_TRUE(channels_->map_voxels.pop()) << "what the whole map calls occupied is new to a flight through it";
}

TEST_F(MapWindowTest, WhatItHasLeftIsKeptWhileThereIsRoom) {
  begin(with_window(100));
  whole(grid_);
  const Vec3 far(-2.5, 0.1, 1.1);
  vehicle({-2.3, 0.5, 1.1});
  say(false, 5, [&](const Vec3& p) { return same_voxel(p, far); });
  vehicle({2.3, 0.5, 1.1});
  say(false, 8, [](const Vec3&) { return false; });
  EXPECT_EQ(at(far), Cell::occupied);
}

// While a world is made scans and clouds wait together. The last word counts, and the age is that of the newest.
TEST_F(MapWindowTest, ANewerWholeMapTakesBackWhatWasCalledFreeAndNoObstacle) {
  begin(with_window(100));
  whole(grid_);
  vehicle({0, 0.5, 1.1});
  say(false, 5, [](const Vec3& p) { return same_voxel(p, kSeenAt); });
  say(true, 6, [](const Vec3& p) { return same_voxel(p, kWallAt); });
  ASSERT_EQ(at(kWallAt), Cell::free);
  whole(grid_, 9);
  EXPECT_EQ(at(kWallAt), Cell::occupied);
  EXPECT_EQ(at(kSeenAt), Cell::occupied);
  EXPECT_EQ(channels_->map_ns.load(), 9);
  say(true, 10, [](const Vec3& p) { return same_voxel(p, kWallAt) || same_voxel(p, kSeenAt); });
  EXPECT_EQ(at(kWallAt), Cell::free) << "and can be said again";
  expect_as_built();
}

TEST_F(MapWindowTest, AMapOfAnotherResolutionThanTheWindowsIsRefusedByTheKey) {
  begin(with_window(100));
  whole(map::builtin_scene("parallel-walls-2m", 0.1).value());
  EXPECT_EQ(channels_->maps_rejected, 1u);
  EXPECT_EQ(world(), nullptr);
}

TEST_F(MapWindowTest, WithoutAWholeMapTheWorldIsWhatTheWindowHasSaidAndMovesWithTheVehicle) {
  begin(with_window(100));
  const auto corridor_wall = [](const Vec3& p) { return std::abs(p.y()) > 0.8; };
  const auto air = [&](const Vec3& p) { return !corridor_wall(p); };
  vehicle({0, 0, 1});
  say(true, 1, air);
  EXPECT_EQ(world(), nullptr) << "before anything could be occupied";
  say(false, 2, corridor_wall);
  ASSERT_NE(world(), nullptr);
  EXPECT_EQ(world()->grid.size(), Index3(15, 15, 15)) << "1.5 times the window";
  EXPECT_EQ(at({0, 0, 1}), Cell::free);
  EXPECT_EQ(at({1.3, 0, 1}), Cell::unknown);
  const plan::World* first = world();
  vehicle({0.3, 0, 1});
  say(false, 3, [](const Vec3&) { return false; });
  EXPECT_EQ(world(), first) << "the window is within that world";
  const Vec3 found(0.5, 0.1, 1.1);
  EXPECT_TRUE(channels_->scans.push(new Scan{{found}, {-0.3, 0.1, 1.1}, 3}));
  step();
  ASSERT_EQ(at(found), Cell::occupied);
  vehicle({0.9, 0, 1});
  say(false, 4, corridor_wall);
  say(true, 4, air);
  ASSERT_GT(world()->grid.origin().x(), -1.2);
  EXPECT_LT(std::abs(world()->grid.center({7, 7, 7}).x() - 0.9), 0.2);
  EXPECT_EQ(at({1.7, 0.1, 1}), Cell::free);
  EXPECT_EQ(at({1.7, 0.9, 1}), Cell::occupied);
  EXPECT_EQ(at({-0.1, 0.1, 1}), Cell::free) << "taken along";
  EXPECT_EQ(at(found), Cell::occupied) << "what a scan has found, too";
  EXPECT_EQ(at({0.1, 0.9, 1}), Cell::occupied);
  expect_as_built();
  EXPECT_EQ(channels_->map_ns.load(), 4);
}

// Its world would need more than map.max_mib; a byte a voxel does not.
TEST_F(MapWindowTest, AWholeMapWithoutRoomForItsWorldIsFlownInByPartsAndReloaded) {
  const double world_mib = 15 * 15 * 15 * 115.0 / (1 << 20);
  const double whole_mib = static_cast<double>(grid_.cell_count()) / (1 << 20);
  begin(with_window(0, world_mib + whole_mib + 0.01));
  ASSERT_LT(world_mib + whole_mib + 0.01, 115 * whole_mib);
  vehicle({-2.3, 0.1, 1.1});
  whole(grid_);
  EXPECT_EQ(channels_->maps_accepted, 1u);
  ASSERT_NE(world(), nullptr);
  EXPECT_EQ(world()->grid.size(), Index3(15, 15, 15));
  const auto as_whole = [&] {
    map::for_each_voxel(map::all_of(world()->grid.size()), [&](const Index3& v) {
      const Vec3 p = world()->grid.center(v);
      EXPECT_EQ(world()->grid.at(v), grid_.at(grid_.index(p)));
    });
  };
  as_whole();
  const Vec3 far(-2.5, 0.1, 1.1);
  say(false, 5, [&](const Vec3& p) { return same_voxel(p, far); });
  EXPECT_EQ(at(far), Cell::occupied);
  for (const double x : {-1.2, 0.0, 1.2, 2.3}) {
    vehicle({x, 0.1, 1.1});
    say(false, 6, [](const Vec3&) { return false; });
  }
  EXPECT_GT(world()->grid.origin().x(), 0);
  as_whole();
  for (const double x : {1.2, 0.0, -1.2, -2.3}) {
    vehicle({x, 0.1, 1.1});
    say(false, 7, [](const Vec3&) { return false; });
  }
  EXPECT_EQ(at(far), Cell::free) << "let go, and reloaded";
  as_whole();
}

// No mapper speaks, or it has died.
TEST_F(MapWindowTest, TheWorldMovesAlongWithoutCloudsAndScans) {
  begin(with_window(0, 15 * 15 * 15 * 115.0 / (1 << 20) + static_cast<double>(grid_.cell_count()) / (1 << 20) + 0.01));
  vehicle({-2.3, 0.1, 1.1});
  whole(grid_, 7);
  ASSERT_NE(world(), nullptr);
  const plan::World* first = world();
  EXPECT_FALSE(step()) << "nothing is new";
  EXPECT_EQ(world(), first);
  for (const double x : {-1.2, 0.0, 1.2, 2.3}) {
    vehicle({x, 0.1, 1.1});
    EXPECT_TRUE(step()) << x;
    EXPECT_EQ(at({x, 0.1, 1.1}), Cell::free) << x;
  }
  EXPECT_GT(world()->grid.origin().x(), 0);
  map::for_each_voxel(map::all_of(world()->grid.size()), [&](const Index3& v) {
    EXPECT_EQ(world()->grid.at(v), grid_.at(grid_.index(world()->grid.center(v))));
  });
  EXPECT_EQ(channels_->map_ns.load(), 7) << "a world that moves is no younger";
}

TEST_F(MapWindowTest, AWholeMapBeyondEvenThatIsRefused) {
  begin(with_window(0, 15 * 15 * 15 * 115.0 / (1 << 20) + static_cast<double>(grid_.cell_count()) / (1 << 20) - 0.001));
  vehicle({0, 0.1, 1.1});
  whole(grid_);
  EXPECT_EQ(channels_->maps_rejected, 1u);
}

TEST_F(MapWindowTest, CloudsWithoutAWorldTakeNoMoreThanTheOnesThatAreKept) {
  begin(with_window(2));
  std::size_t most = 0;
  const std::size_t before = bytes();
  for (int n = 0; n <= 400; ++n) {
    vehicle({1.0 * n, 0, 1});
    say(false, n + 1, [](const Vec3&) { return true; });  // and none of free ones
    most = std::max(most, bytes() - std::min(before, bytes()));
  }
  EXPECT_EQ(world(), nullptr);
  EXPECT_LT(most, (2 + map::SeenWindow::parts_of(settings_.window.voxels())) * map::SeenWindow::kPartBytes +
                      512 * static_cast<std::size_t>(settings_.window.voxels().prod()));
}

// By which a goal outside of it is told apart from one outside of a map.
TEST_F(MapWindowTest, AWorldThatGoesAlongIsToldUntilAWholeMapHasItsPlace) {
  begin(with_window(100));
  vehicle({0, 0, 1});
  EXPECT_FALSE(channels_->world_moves);
  say(false, 1, [](const Vec3&) { return false; });
  say(true, 2, [](const Vec3&) { return true; });
  ASSERT_TRUE(world());
  EXPECT_TRUE(channels_->world_moves);
  whole(grid_, 3);
  EXPECT_EQ(world()->grid.size(), grid_.size());
  EXPECT_FALSE(channels_->world_moves);
}

}  // namespace
}  // namespace backwash::daemon

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
