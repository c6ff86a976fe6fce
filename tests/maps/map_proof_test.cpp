// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/octomap/octomap_file.hpp"
#include "services/backwash/site/map_input.hpp"
#include "tests/maps/files.hpp"

namespace backwash::services {
namespace {

/// A room of 4 x 2 x 2 m that a wall at x = 2.05 divides, its corners given by number alone, as some programs write it.
constexpr const char* kTwoRooms =
    "v 0.05 0.05 0.05\nv 4.05 0.05 0.05\nv 4.05 2.05 0.05\nv 0.05 2.05 0.05\nvn 0 0 1\n"
    "v 2.05 0.05 0.05\nv 2.05 2.05 0.05\nv 2.05 2.05 2.05\nv 2.05 0.05 2.05\n"
    "o floor\nf 1//1 2//1 3//1 4//1\no wall\nf 5/5/1 6/6/1 7/7/1 8/8/1\n";

class MapProof : public maps::MapFiles {
 protected:
  void SetUp() override {
    MapFiles::SetUp();
    std::ofstream(folder_ + "rooms.obj") << kTwoRooms;
  }
  MadeMap made() {
    MapOptions options;
    options.file = folder_ + "rooms.obj";
    return make_map(options);
  }
  std::string lost(const map::OccupancyGrid& written, const MadeMap& made) {
    std::ofstream(folder_ + "rooms.bt", std::ios::binary) << map::octomap_file(written);
    return lost_in(folder_ + "rooms.bt", made, "rooms.obj");
  }
};

TEST_F(MapProof, FindsNothingLostInAMapThatHoldsEveryTriangle) {
  const auto rooms = made();
  EXPECT_EQ(rooms.triangles, 4u);
  EXPECT_EQ(lost(rooms.grid, rooms), "");
}

TEST_F(MapProof, NamesTheTriangleAndItsLineWhereAWallIsMissingInTheVoxels) {
  auto rooms = made();
  for (std::size_t n = 0; n < rooms.grid.cell_count(); ++n)
    if (rooms.grid.voxel(n).x() == 20 && rooms.grid.voxel(n).z() > 0)
      rooms.grid.set(rooms.grid.voxel(n), map::Cell::free);
  const auto why = lost(rooms.grid, rooms);
  EXPECT_EQ(why.find("lacks triangle 3 of rooms.obj:13 at (2.05, "), 0u) << why;
}

TEST_F(MapProof, NamesAVoxelThatTheFileDoesNotHoldAsItWasMade) {
  const auto rooms = made();
  auto written = rooms.grid;
  written.set(written.index({2.05, 1, 1}), map::Cell::free);
  EXPECT_EQ(lost(written, rooms).find("the voxel at (2.05, 1.05, 1.05) is read back otherwise"), 0u);
  std::ofstream(folder_ + "empty.bt");
  EXPECT_NE(lost_in(folder_ + "empty.bt", rooms, "rooms.obj"), "");
}

}  // namespace
}  // namespace backwash::services
