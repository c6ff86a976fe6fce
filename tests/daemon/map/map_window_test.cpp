// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

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

// The formula of docs/interfaces.md: the window's worlds and what is kept, however far it flies.
TEST_F(MapWindowTest, AKilometreOfCorridorTakesNoMoreThanTheStatedBytes) {
  constexpr std::size_t kKeep = 30;
  begin(with_window(kKeep));
  const auto wall = [](const Vec3& p) { return std::abs(p.y()) > 0.8; };
  const auto world_voxels = static_cast<std::size_t>(settings_.window.world().prod());
  const auto window_voxels = static_cast<std::size_t>(settings_.window.voxels().prod());
  const std::size_t stated =
      (kKeep + map::SeenWindow::parts_of(settings_.window.voxels())) * map::SeenWindow::kPartBytes +
      2 * config::kWorldBytesPerVoxel * world_voxels + 512 * window_voxels;
  std::size_t most = 0, worlds = 0, before = 0;
  const plan::World* last = nullptr;
  for (int n = 0; n <= 2000; ++n) {  // 0.5 m a step
    vehicle({0.5 * n, 0, 1});
    say(false, n + 1, wall);
    say(true, n + 1, [&](const Vec3& p) { return !wall(p); });
    ASSERT_EQ(at({0.5 * n, 0, 1}), Cell::free);
    worlds += world() != std::exchange(last, world());
    channels_->worlds.collect();
    if (n == 0) before = bytes();
    most = std::max(most, bytes());
  }
  // What there is after the first step is one world of the two.
  const std::size_t grown = most - std::min(most, before) + config::kWorldBytesPerVoxel * world_voxels;
  RecordProperty("bytes_over_stated", std::to_string(static_cast<double>(grown) / static_cast<double>(stated)));
  EXPECT_LT(grown, stated);
  EXPECT_GT(worlds, 900u) << "it has moved";
}

}  // namespace
}  // namespace backwash::daemon
