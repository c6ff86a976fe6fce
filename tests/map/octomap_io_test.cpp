// SPDX-License-Identifier: BSD-3-Clause
// Oracle: liboctomap itself, with which files are exchanged in both directions.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <octomap/ColorOcTree.h>
#include <octomap/OcTreeStamped.h>

#include <unistd.h>

#include <bit>
#include <filesystem>
#include <fstream>
#include <limits>

#include "core/map/load_map.hpp"
#include "core/map/octomap/octomap_message.hpp"
#include "tests/map/liboctomap.hpp"
#include "tests/map/random_grid.hpp"
#include "tests/support/write_octomap.hpp"

namespace backwash::map {
namespace {

class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& extension)
      : path_(testing::TempDir() + "backwash_map_" + std::to_string(getpid()) + extension) {}
  ~TemporaryFile() { std::filesystem::remove(path_); }
  const std::string& path() const { return path_; }
  void write(const std::string& content) const { std::ofstream(path_, std::ios::binary) << content; }
  std::string content() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

 private:
  std::string path_;
};

TEST(OctomapFile, RoundTripsRandomGrids) {
  std::mt19937_64 random(3);
  const TemporaryFile file(".bt");
  for (int round = 0; round < 100; ++round) {
    const auto grid = random_grid(random, 30);
    ASSERT_TRUE(write_octomap(grid, file.path()));
    const auto loaded = load_octomap(file.path());
    ASSERT_EQ(loaded.has_value(), has_known_cells(grid));
    if (loaded) expect_same_world(*loaded, grid);
  }
}

TEST(OctomapFile, IsReadBackByLiboctomap) {
  std::mt19937_64 random(4);
  const TemporaryFile file(".bt");
  for (int round = 0; round < 20; ++round) {
    const auto grid = random_grid(random, 20);
    if (!has_known_cells(grid)) continue;
    ASSERT_TRUE(write_octomap(grid, file.path()));
    const octomap::OcTree tree(file.path());
    ASSERT_EQ(tree.getResolution(), grid.resolution());
    for (std::size_t i = 0; i < grid.cell_count(); ++i) {
      ASSERT_EQ(cell_of(tree, grid.center(grid.voxel(i))), grid.at(i));
    }
  }
}

TEST(OctomapFile, ReadsBothFormatsOfLiboctomap) {
  const auto world = builtin_scene("apartment", 0.1).value();
  auto tree = tree_of(world);
  for (const std::string extension : {".bt", ".ot"}) {
    const TemporaryFile file(extension);
    ASSERT_TRUE(extension == ".bt" ? tree.writeBinary(file.path()) : tree.write(file.path()));
    const auto loaded = load_map(file.path());
    ASSERT_TRUE(loaded) << loaded.error().message;
    expect_same_world(*loaded, world);
  }
}

/// The world in a tree of liboctomap whose nodes hold more than occupancy, in both formats.
template <class Tree, class Mark>
void reads_occupancy_of(const OccupancyGrid& world, Mark mark) {
  Tree tree(world.resolution());
  for (std::size_t i = 0; i < world.cell_count(); ++i)
    if (world.at(i) != Cell::unknown)
      mark(*tree.updateNode(point(world.center(world.voxel(i))), world.at(i) == Cell::occupied, true), i);
  tree.updateInnerOccupancy();
  for (const bool binary : {true, false}) {
    const TemporaryFile file(binary ? ".bt" : ".ot");
    ASSERT_TRUE(binary ? tree.writeBinary(file.path()) : tree.write(file.path()));
    const auto loaded = load_map(file.path());
    ASSERT_TRUE(loaded) << tree.getTreeType() << ": " << loaded.error().message;
    expect_same_world(*loaded, world);
    const std::string whole = file.content();
    for (std::size_t cut = 1; cut < 12; ++cut) {  // within a node, its colour too
      file.write(whole.substr(0, whole.size() - cut));
      EXPECT_FALSE(load_map(file.path())) << tree.getTreeType() << " without its last " << cut << " bytes";
    }
  }
}

TEST(OctomapFile, ReadsTheOccupancyOfColouredAndStampedTrees) {
  std::mt19937_64 random(11);
  auto grid = random_grid(random, 20);
  while (!has_known_cells(grid)) grid = random_grid(random, 20);
  for (const auto& world : {grid, builtin_scene("narrow-gap", 0.2).value()}) {
    reads_occupancy_of<octomap::ColorOcTree>(world, [](octomap::ColorOcTreeNode& node, std::size_t i) {
      node.setColor(static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(i >> 8), 255);
    });
    reads_occupancy_of<octomap::OcTreeStamped>(
        world, [](octomap::OcTreeNodeStamped& node, std::size_t i) { node.setTimestamp(static_cast<unsigned>(i)); });
  }
}

/// A small world in both formats, to be damaged.
std::vector<std::string> sample_files() {
  auto tree = tree_of(builtin_scene("narrow-gap", 0.2).value());
  std::vector<std::string> contents;
  for (const std::string extension : {".bt", ".ot"}) {
    const TemporaryFile file(extension);
    extension == ".bt" ? tree.writeBinary(file.path()) : tree.write(file.path());
    contents.push_back(file.content());
  }
  return contents;
}

TEST(OctomapFile, RefusesTruncations) {
  const TemporaryFile file(".bt");
  for (const auto& content : sample_files()) {
    for (std::size_t length = 0; length < content.size(); length += length < 150 ? 1 : content.size() / 60) {
      file.write(content.substr(0, length));
      const auto grid = load_octomap(file.path());
      ASSERT_FALSE(grid) << length << " of " << content.size();
      ASSERT_EQ(grid.error().kind, MapError::Kind::corrupt);
    }
    file.write(content + '\0');
    EXPECT_FALSE(load_octomap(file.path())) << "a byte too many";
    file.write(content);
    EXPECT_TRUE(load_octomap(file.path()));
  }
}

TEST(OctomapFile, NamesTheFileAndTheFaultInOneLine) {
  const std::string good = sample_files().front();
  const TemporaryFile file(".bt");
  const auto replaced = [&](const std::string& line, const std::string& by) {
    std::string content = good;
    const auto at = content.find("\n" + line) + 1;
    return content.replace(at, content.find('\n', at) + 1 - at, by);
  };
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "first line"},
      {"ply\n" + good, "first line"},
      {replaced("id ", "id RoughOcTree\n"), "convert_octree IN OUT.bt"},
      {replaced("id ", ""), "OcTree"},
      {replaced("res ", "res 0\n"), "resolution"},
      {replaced("res ", "res -0.1\n"), "resolution"},
      {replaced("res ", "res nan\n"), "resolution"},
      {replaced("res ", "res 1e300\n"), "resolution"},
      {replaced("res ", "res 1e999\n"), "res METRES"},
      {replaced("res ", "res 0.1m\n"), "res METRES"},
      {replaced("res ", ""), "res METRES"},
      {replaced("size ", "size 7\n"), "size 7"},
      {replaced("size ", "size 18446744073709551615\n"), "size 18446744073709551615"},
      {replaced("size ", "size 99999999999999999999\n"), "size NODES"},
      {replaced("size ", "size -1\n"), "size NODES"},
      {replaced("data", ""), "data"},
  };
  for (const auto& [content, word] : cases) {
    file.write(content);
    const auto grid = load_octomap(file.path());
    ASSERT_FALSE(grid) << word;
    EXPECT_EQ(grid.error().kind, MapError::Kind::corrupt) << grid.error().message;
    EXPECT_TRUE(grid.error().message.starts_with(file.path() + ": ")) << grid.error().message;
    EXPECT_NE(grid.error().message.find(word, file.path().size()), std::string::npos) << grid.error().message;
    EXPECT_EQ(grid.error().message.find('\n'), std::string::npos);
  }
}

TEST(OctomapFile, SaysWhatIsNotAFile) {
  for (const std::string path : {"/nowhere/at/all.bt", "/tmp", "/dev/zero", ""}) {
    const auto grid = load_octomap(path);
    ASSERT_FALSE(grid);
    EXPECT_EQ(grid.error().kind, MapError::Kind::not_found) << grid.error().message;
  }
}

class RealMap : public testing::TestWithParam<const char*> {
 protected:
  std::string path() const { return std::string(BACKWASH_SOURCE_DIR "/tests/data/maps/") + GetParam(); }
};

TEST_P(RealMap, EqualsLiboctomapsReading) {
  const auto grid = load_octomap(path());
  ASSERT_TRUE(grid) << grid.error().message;
  octomap::OcTree tree(path());
  ASSERT_EQ(grid->resolution(), tree.getResolution());
  Vec3 low;
  Vec3 high;
  tree.getMetricMin(low.x(), low.y(), low.z());
  tree.getMetricMax(high.x(), high.y(), high.z());
  EXPECT_NEAR((grid->origin() - low).norm(), 0, 1e-6);
  EXPECT_NEAR((grid->origin() + grid->resolution() * grid->size().cast<double>() - high).norm(), 0, 1e-6);
  for (std::size_t i = 0; i < grid->cell_count(); ++i) {
    ASSERT_EQ(grid->at(i), cell_of(tree, grid->center(grid->voxel(i)))) << grid->voxel(i).transpose();
  }
}
INSTANTIATE_TEST_SUITE_P(Shared, RealMap, testing::Values("geb079.bt", "huayu_room_0.05.bt"),
                         [](const auto& map) { return std::string(map.param).substr(0, 4); });

TEST(Geb079, HasItsPublishedExtentFloorAndCeiling) {
  const std::string path = BACKWASH_SOURCE_DIR "/tests/data/maps/geb079.bt";
  const auto grid = load_octomap(path).value();
  EXPECT_EQ(grid.resolution(), 0.08);
  const Vec3 extent = grid.resolution() * grid.size().cast<double>();
  EXPECT_NEAR(extent.x(), 39, 0.5);
  EXPECT_NEAR(extent.y(), 15, 0.5);
  EXPECT_NEAR(extent.z(), 3.1, 0.05);
  std::vector<int> layers(static_cast<std::size_t>(grid.size().z()));
  for (std::size_t i = 0; i < grid.cell_count(); ++i) {
    if (grid.at(i) == Cell::occupied) ++layers[static_cast<std::size_t>(grid.voxel(i).z())];
  }
  const auto layer = [&](double z) { return grid.index({0, 0, z}).z(); };
  const auto between = *std::max_element(layers.begin() + layer(0.04), layers.begin() + layer(2.6));
  EXPECT_GT(layers.at(static_cast<std::size_t>(layer(-0.15))), 1.5 * between) << "floor";
  EXPECT_GT(layers.at(static_cast<std::size_t>(layer(2.7))), 1.5 * between) << "ceiling";
}

// A damaged tree is refused for what is wrong with it, not by luck further on.

using ::testing::HasSubstr;
using Bytes = std::vector<std::int8_t>;

std::string fault(const Bytes& data, bool binary) {
  const auto grid = decode_octomap(data, 0.1, binary, "OcTree", std::size_t{1} << 20);
  return grid ? std::string("taken") : grid.error().message;
}

/// A node of a full tree: log-odds and children.
Bytes full_node(float log_odds, std::uint8_t children) {
  const auto bits = std::bit_cast<std::uint32_t>(log_odds);
  Bytes bytes;
  for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<std::int8_t>(bits >> shift & 0xff));
  bytes.push_back(static_cast<std::int8_t>(children));
  return bytes;
}

TEST(OctomapFaults, ANodeWithoutANumber) {
  Bytes tree;
  for (int level = 0; level < 16; ++level)
    for (const auto b : full_node(0, 1)) tree.push_back(b);
  Bytes good = tree, bad = tree;
  for (const auto b : full_node(0.5F, 0)) good.push_back(b);
  for (const auto b : full_node(std::numeric_limits<float>::quiet_NaN(), 0)) bad.push_back(b);
  EXPECT_EQ(fault(good, false), "taken");
  EXPECT_THAT(fault(bad, false), HasSubstr("not a number"));
}

TEST(OctomapFaults, AnInnerNodeWithoutChildren) {
  EXPECT_THAT(fault({0x00, 0x00}, true), HasSubstr("no children"));
  EXPECT_THAT(fault({0x03, 0x00, 0x00, 0x00}, true), HasSubstr("no children"));
}

}  // namespace
}  // namespace backwash::map
