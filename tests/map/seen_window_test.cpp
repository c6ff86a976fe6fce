// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/scan/seen_window.hpp"

#include <gtest/gtest.h>
#include <malloc.h>

#include <map>
#include <random>
#include <set>
#include <tuple>

namespace backwash::map {
namespace {

constexpr std::size_t kPlenty = 1u << 20;
const Index3 kV(3, -7, 20);

TEST(SeenWindow, SaysNothingOfAVoxelThatNoCloudListed) {
  SeenWindow seen(kPlenty);
  EXPECT_EQ(seen.at(kV), Cell::unknown);
  seen.occupied(std::vector{kV}, 1);
  EXPECT_EQ(seen.at(kV), Cell::occupied);
  EXPECT_EQ(seen.at(kV + Index3(1, 0, 0)), Cell::unknown);
}

// A mapper that no longer lists a voxel has not said that it is free.
TEST(SeenWindow, AVoxelIsFreedByACloudOfFreeOnesAloneAndNeverBecauseItIsNotListed) {
  SeenWindow seen(kPlenty);
  seen.occupied(std::vector{kV}, 1);
  EXPECT_TRUE(seen.occupied({}, 2).empty());
  EXPECT_EQ(seen.at(kV), Cell::occupied);
  EXPECT_EQ(seen.freed(std::vector{kV}, 3).size(), 1u);
  EXPECT_EQ(seen.at(kV), Cell::free);
  EXPECT_TRUE(seen.freed(std::vector{kV}, 4).empty()) << "that is known";
}

TEST(SeenWindow, OccupiedWinsAtOneStampInEitherOrderAndOverAnOlderCloudOfFreeVoxels) {
  for (const bool free_first : {false, true})
    for (const std::int64_t free_stamp : {4, 5}) {
      SeenWindow seen(kPlenty);
      if (free_first) seen.freed(std::vector{kV}, free_stamp);
      seen.occupied(std::vector{kV, Index3(0, 0, 0)}, 5);
      if (!free_first) seen.freed(std::vector{Index3(9, 9, 9), kV}, free_stamp);
      EXPECT_EQ(seen.at(kV), Cell::occupied) << free_first << " " << free_stamp;
    }
}

// Clouds of two topics come in any order: a late one of free voxels is older than the obstacle, if not than the newest.
TEST(SeenWindow, AFreeCloudFreesNothingThatAnyOccupiedCloudListsAtItsStampOrLater) {
  const Index3 other(0, 0, 0);
  SeenWindow seen(kPlenty);
  seen.occupied(std::vector{kV}, 50);
  seen.occupied(std::vector{other}, 60);
  for (const std::int64_t stamp : {40, 50}) {
    EXPECT_TRUE(seen.freed(std::vector{kV}, stamp).empty());
    EXPECT_EQ(seen.at(kV), Cell::occupied) << stamp;
  }
  EXPECT_EQ(seen.freed(std::vector{kV}, 55).size(), 1u) << "later than the newest that lists it";
  // However many clouds came since.
  seen.occupied(std::vector{kV}, 70);
  for (int n = 0; n < 20; ++n) seen.occupied(std::vector{other}, 80 + n);
  seen.freed(std::vector{kV}, 65);
  EXPECT_EQ(seen.at(kV), Cell::occupied);
  EXPECT_EQ(seen.freed(std::vector{kV}, 99).size(), 1u);
}

TEST(SeenWindow, OfTwoOccupiedCloudsOfOneStampNeitherIsFreedAtIt) {
  SeenWindow seen(kPlenty);
  seen.occupied(std::vector{kV}, 5);
  seen.occupied(std::vector{Index3(0, 0, 0)}, 5);
  seen.freed(std::vector{kV}, 5);
  EXPECT_EQ(seen.at(kV), Cell::occupied);
  EXPECT_EQ(seen.freed(std::vector{kV}, 6).size(), 1u);
}

TEST(SeenWindow, StampsOfAnotherMapperCountFromAnewAndWhatWasSaidStays) {
  const Index3 other(0, 0, 0);
  SeenWindow seen(kPlenty);
  seen.occupied(std::vector{other}, 1000);
  seen.restart();
  seen.occupied(std::vector{kV}, 2);
  EXPECT_TRUE(seen.freed(std::vector{kV}, 2).empty());
  EXPECT_EQ(seen.at(kV), Cell::occupied);
  EXPECT_EQ(seen.at(other), Cell::occupied);
  EXPECT_EQ(seen.freed(std::vector{kV, other}, 3).size(), 2u);
}

TEST(SeenWindow, AWholeMapTakesFreeBackAndLeavesWhatIsOccupied) {
  SeenWindow seen(kPlenty);
  const Index3 other(100, 100, 100);
  seen.occupied(std::vector{kV}, 1);
  seen.freed(std::vector{Index3(kV + Index3(1, 0, 0)), other}, 2);
  seen.forget_free();
  EXPECT_EQ(seen.at(kV), Cell::occupied);
  EXPECT_EQ(seen.at(kV + Index3(1, 0, 0)), Cell::unknown);
  EXPECT_EQ(seen.at(other), Cell::unknown);
  EXPECT_EQ(seen.parts(), 1u) << "a part of which nothing is said takes no memory";
  EXPECT_EQ(seen.freed(std::vector{other}, 3).size(), 1u) << "it can be said again";
}

TEST(SeenWindow, AgreesWithATableOfVoxelsWhateverIsSaid) {
  std::mt19937_64 random(1);
  SeenWindow seen(kPlenty);
  std::map<std::tuple<int, int, int>, Cell> table;
  std::map<std::tuple<int, int, int>, std::int64_t> listed;  // the newest stamp at which it was occupied
  std::set<std::int64_t> stamps;
  std::int64_t shared = -9;  // the newest stamp of two clouds
  const auto of = [](const Index3& v) { return std::tuple(v.x(), v.y(), v.z()); };
  for (std::int64_t stamp = 0; stamp < 400; ++stamp) {
    std::vector<Index3> voxels;
    for (int n = 0; n < 40; ++n)
      voxels.emplace_back(static_cast<int>(random() % 12) - 6, static_cast<int>(random() % 8) - 4,
                          static_cast<int>(random() % 4) - 2);
    std::size_t changed = 0;
    const bool occupied = random() % 2;
    const std::int64_t at = stamp - static_cast<std::int64_t>(random() % 3);
    if (occupied && !stamps.insert(at).second) shared = std::max(shared, at);
    for (const Index3& v : voxels) {
      std::int64_t& since = listed.try_emplace(of(v), -9).first->second;
      if (occupied) since = std::max(since, at);
      Cell& cell = table.try_emplace(of(v), Cell::unknown).first->second;
      const bool held = !occupied && (at <= since || (at <= shared && cell == Cell::occupied));
      const Cell now = occupied ? Cell::occupied : held ? cell : Cell::free;
      changed += now != std::exchange(cell, now);
    }
    EXPECT_EQ((occupied ? seen.occupied(voxels, at) : seen.freed(voxels, at)).size(), changed);
  }
  for (const auto& [v, cell] : table) EXPECT_EQ(seen.at({std::get<0>(v), std::get<1>(v), std::get<2>(v)}), cell);
}

TEST(SeenWindow, LetsGoOfTheFarthestPartsBeyondTheStatedNumberAndOfNoneThatTheWindowMeets) {
  SeenWindow seen(3);
  std::vector<Index3> voxels;
  for (int n = 0; n < 6; ++n) voxels.emplace_back(16 * n, 0, 0);
  seen.occupied(std::vector{voxels[1]}, 1);
  seen.freed(voxels, 2);
  seen.occupied(std::vector{voxels[1]}, 3);
  const VoxelBox window{{16 * 4, 0, 0}, {16 * 5 + 3, 3, 3}};
  const auto gone = seen.evict(window);
  EXPECT_EQ(seen.parts(), 3u);
  ASSERT_EQ(gone.size(), 3u);
  for (const auto& [v, said] : gone) EXPECT_EQ(said, v == voxels[1] ? Cell::occupied : Cell::free);
  for (int n = 0; n < 6; ++n)
    EXPECT_EQ(seen.at(voxels[static_cast<std::size_t>(n)]), n < 3 ? Cell::unknown : Cell::free);
  EXPECT_TRUE(seen.evict(window).empty()) << "no more than is needed";
  // All of a window is kept, whatever the number.
  EXPECT_EQ(seen.evict({{-1000, -1000, -1000}, {1000, 1000, 1000}}).size(), 0u);
  SeenWindow none(0);
  none.freed(voxels, 1);
  EXPECT_TRUE(none.evict({{0, 0, 0}, {16 * 6, 1, 1}}).empty());
  EXPECT_EQ(none.parts(), 6u);
}

// The formula of docs/interfaces.md, "A window that moves": what is kept, and one window.
TEST(SeenWindow, HoldsNoMoreThanTheStatedBytesOverAKilometreOfCorridor) {
  constexpr std::size_t kKept = 40;
  const Index3 size(60, 40, 25);
  constexpr std::size_t kWalls = 2 * 60 * 25;  // voxels that a cloud lists as occupied
  const std::size_t stated = (kKept + SeenWindow::parts_of(size)) * SeenWindow::kPartBytes +
                             12 * (static_cast<std::size_t>(size.prod()) + (SeenWindow::kRecent - 1) * kWalls);
  SeenWindow seen(kKept);
  std::size_t most_parts = 0, most_bytes = 0;
  const std::size_t before = mallinfo2().uordblks + mallinfo2().hblkhd;
  for (int at = 0; at < 10'000; at += 20) {  // voxels of 0.1 m: 1 km
    const Index3 low(at - 30, -20, 0);
    std::vector<Index3> walls, air;
    for_each_voxel({low, low + size - Index3::Ones()},
                   [&](const Index3& v) { (v.y() == -20 || v.y() == 19 ? walls : air).push_back(v); });
    seen.occupied(walls, at);
    seen.freed(air, at);
    most_parts = std::max(most_parts, seen.parts());
    seen.evict({low, low + size - Index3::Ones()});
    walls = {};
    air = {};
    most_bytes = std::max(most_bytes, mallinfo2().uordblks + mallinfo2().hblkhd - before);
  }
  RecordProperty("bytes_over_stated", std::to_string(static_cast<double>(most_bytes) / static_cast<double>(stated)));
  EXPECT_LE(most_parts, kKept + SeenWindow::parts_of(size));
  EXPECT_LE(most_bytes, stated);
  EXPECT_GT(most_bytes, stated / 4) << "or this counts nothing";
}

}  // namespace
}  // namespace backwash::map
