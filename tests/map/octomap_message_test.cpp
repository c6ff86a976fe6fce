// SPDX-License-Identifier: BSD-3-Clause
// Oracle: liboctomap itself, with which messages are exchanged in both directions.
#include "core/map/octomap/octomap_message.hpp"

#include <fstream>
#include <limits>

#include "tests/map/liboctomap.hpp"
#include "tests/map/random_grid.hpp"

namespace backwash::map {
namespace {

TEST(OctomapMessage, HasTheBytesThatLiboctomapWrites) {
  std::mt19937_64 random(1);
  for (int round = 0; round < 200; ++round) {
    const auto grid = random_grid(random, 24);
    std::stringstream stream;
    tree_of(grid).writeBinaryData(stream);
    ASSERT_EQ(encode_octomap(grid), bytes_of(stream)) << "round " << round;
  }
}

TEST(OctomapMessage, DecodesWhatLiboctomapWrites) {
  std::mt19937_64 random(2);
  for (int round = 0; round < 100; ++round) {
    const auto grid = random_grid(random, 24);
    const auto tree = tree_of(grid);
    std::stringstream binary;
    std::stringstream full;
    tree.writeBinaryData(binary);
    if (has_known_cells(grid)) tree.writeData(full);
    for (const bool is_binary : {true, false}) {
      const auto decoded = decode_octomap(bytes_of(is_binary ? binary : full), grid.resolution(), is_binary, "OcTree");
      ASSERT_EQ(decoded.has_value(), has_known_cells(grid));
      if (decoded) expect_same_world(*decoded, grid);
    }
  }
}

TEST(OctomapMessage, FullTreesAreOccupiedFromEvenOdds) {
  octomap::OcTree tree(0.1);
  tree.setNodeValue(octomap::point3d(0.05F, 0.05F, 0.05F), 0.0F);
  tree.setNodeValue(octomap::point3d(0.15F, 0.05F, 0.05F), -1e-6F);
  tree.setNodeValue(octomap::point3d(0.25F, 0.05F, 0.05F), 0.4F);
  std::stringstream full;
  tree.writeData(full);
  const auto grid = decode_octomap(bytes_of(full), 0.1, false, "OcTree");
  ASSERT_TRUE(grid);
  ASSERT_EQ(grid->size(), Index3(3, 1, 1));
  EXPECT_TRUE(grid->occupied({0, 0, 0}));
  EXPECT_TRUE(grid->free({1, 0, 0}));
  EXPECT_TRUE(grid->occupied({2, 0, 0}));
}

TEST(OctomapMessage, RefusesGridsOffTheLatticeOfVoxels) {
  EXPECT_THROW(encode_octomap(OccupancyGrid({0.04, 0, 0}, 0.1, {2, 2, 2}, Cell::free)), std::invalid_argument);
  EXPECT_THROW(encode_octomap(OccupancyGrid({3276.75, 0, 0}, 0.1, {9, 2, 2}, Cell::free)), std::invalid_argument);
}

TEST(OctomapMessage, RefusesForeignTreesAndImpossibleResolutions) {
  const auto data = encode_octomap(OccupancyGrid({0, 0, 0}, 0.1, {2, 2, 2}, Cell::free));
  EXPECT_TRUE(decode_octomap(data, 0.1, true, "OcTree"));
  EXPECT_TRUE(decode_octomap(data, 0.1, true, "ColorOcTree")) << "the binary stream is the same for every tree";
  EXPECT_FALSE(decode_octomap(data, 0.1, true, "RoughOcTree"));
  EXPECT_FALSE(decode_octomap(data, 0.1, true, ""));
  EXPECT_FALSE(decode_octomap(data, 0.1, false, "OcTree"));
  for (const double resolution : {0.0, -0.1, 1e300, 1e-9, std::numeric_limits<double>::quiet_NaN()}) {
    const auto grid = decode_octomap(data, resolution, true, "OcTree");
    ASSERT_FALSE(grid) << resolution;
    EXPECT_EQ(grid.error().kind, MapError::Kind::corrupt);
  }
}

/// A well-formed tree of one free leaf below `inner` nested inner nodes.
Bytes chain(int inner, bool binary) {
  Bytes data;
  for (int level = 0; level < inner; ++level) {
    if (binary) {
      data.insert(data.end(), {static_cast<std::int8_t>(level + 1 < inner ? 3 : 1), 0});
    } else {
      data.insert(data.end(), {0, 0, 0, 0, 1});
    }
  }
  if (!binary) data.insert(data.end(), {0, 0, 0, -0x80, 0});  // log-odds −0: even
  return data;
}

TEST(OctomapMessage, RefusesTreesDeeperThanSixteenLevels) {
  for (const bool binary : {true, false}) {
    const auto voxel = decode_octomap(chain(16, binary), 0.1, binary, "OcTree");
    ASSERT_TRUE(voxel) << voxel.error().message;
    EXPECT_EQ(voxel->size(), Index3(1, 1, 1));
    for (const int levels : {17, 18, 100000}) {
      const auto grid = decode_octomap(chain(levels, binary), 0.1, binary, "OcTree");
      ASSERT_FALSE(grid) << levels;
      EXPECT_NE(grid.error().message.find("deeper"), std::string::npos) << grid.error().message;
    }
  }
}

std::size_t peak_address_space_kib() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmPeak:")) return std::stoul(line.substr(7));
  }
  return 0;
}

TEST(OctomapMessage, RefusesHugeExtentsBeforeAllocating) {
  octomap::OcTree tree(0.1);
  tree.updateNode(octomap::point3d(-3000, -3000, -3000), true);
  tree.updateNode(octomap::point3d(3000, 3000, 3000), true);
  std::stringstream stream;
  tree.writeBinaryData(stream);
  const auto data = bytes_of(stream);
  const auto before = peak_address_space_kib();
  ASSERT_GT(before, 0U);
  const auto grid = decode_octomap(data, 0.1, true, "OcTree");
  ASSERT_FALSE(grid);
  EXPECT_EQ(grid.error().kind, MapError::Kind::too_large);
  const Bytes everything = {0, 0, 0, 0, 0};  // writeData of a root that is a leaf: 65536³ voxels
  EXPECT_EQ(decode_octomap(everything, 0.1, false, "OcTree").error().kind, MapError::Kind::too_large);
  EXPECT_LT(peak_address_space_kib() - before, 4096U);
}

TEST(OctomapMessage, HoldsTheCapToTheByte) {
  const auto data = encode_octomap(OccupancyGrid({0, 0, 0}, 0.1, {10, 20, 30}, Cell::free));
  EXPECT_TRUE(decode_octomap(data, 0.1, true, "OcTree", 6000 * sizeof(Cell)));
  EXPECT_FALSE(decode_octomap(data, 0.1, true, "OcTree", 6000 * sizeof(Cell) - 1));
}

}  // namespace
}  // namespace backwash::map
