// SPDX-License-Identifier: BSD-3-Clause
// Oracle: liboctomap itself, with which files and messages are exchanged in both directions.
#include <gtest/gtest.h>
#include <octomap/OcTree.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include "core/map/load_map.hpp"
#include "core/map/octomap_message.hpp"
#include "tests/map/random_grid.hpp"

namespace backwash::map {
namespace {

using Bytes = std::vector<std::int8_t>;

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

octomap::point3d point(const Vec3& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

/// The grid as liboctomap's own pruned tree.
octomap::OcTree tree_of(const OccupancyGrid& grid) {
  octomap::OcTree tree(grid.resolution());
  for (std::size_t i = 0; i < grid.cell_count(); ++i) {
    if (grid.at(i) == Cell::unknown) continue;
    const float value = grid.at(i) == Cell::occupied ? tree.getClampingThresMaxLog() : tree.getClampingThresMinLog();
    tree.setNodeValue(point(grid.center(grid.voxel(i))), value, true);
  }
  tree.updateInnerOccupancy();
  tree.prune();
  return tree;
}

Cell cell_of(const octomap::OcTree& tree, const Vec3& p) {
  const auto* node = tree.search(point(p));
  return !node ? Cell::unknown : tree.isNodeOccupied(node) ? Cell::occupied : Cell::free;
}

Bytes bytes_of(const std::stringstream& stream) {
  const std::string text = stream.str();
  return {text.begin(), text.end()};
}

/// `loaded` covers exactly the bounding box of `grid`'s known cells, and both agree everywhere.
void expect_same_world(const OccupancyGrid& loaded, const OccupancyGrid& grid) {
  Index3 low = grid.size();
  Index3 high = Index3::Zero();
  for (std::size_t i = 0; i < grid.cell_count(); ++i) {
    const Index3 v = grid.voxel(i);
    ASSERT_EQ(loaded.at(loaded.index(grid.center(v))), grid.at(i)) << v.transpose();
    if (grid.at(i) == Cell::unknown) continue;
    low = low.cwiseMin(v);
    high = high.cwiseMax(v + Index3::Ones());
  }
  EXPECT_EQ(loaded.size(), Index3(high - low));
  EXPECT_NEAR((loaded.origin() - grid.origin() - grid.resolution() * low.cast<double>()).norm(), 0, 1e-9);
  EXPECT_EQ(loaded.resolution(), grid.resolution());
}

bool has_known_cells(const OccupancyGrid& grid) {
  return std::ranges::any_of(grid.cells(), [](Cell c) { return c != Cell::unknown; });
}

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
  const auto written = write_octomap(OccupancyGrid({0.04, 0, 0}, 0.1, {2, 2, 2}), testing::TempDir() + "never.bt");
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().kind, MapError::Kind::cannot_write);
}

TEST(OctomapMessage, RefusesForeignTreesAndImpossibleResolutions) {
  const auto data = encode_octomap(OccupancyGrid({0, 0, 0}, 0.1, {2, 2, 2}, Cell::free));
  EXPECT_TRUE(decode_octomap(data, 0.1, true, "OcTree"));
  EXPECT_FALSE(decode_octomap(data, 0.1, true, "ColorOcTree"));
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

/// One to four bits of a random part of `bytes` turned over; every other one hits the top of the tree or the header,
/// where it hurts most.
template <class Container>
Container damaged(Container bytes, std::mt19937_64& random) {
  for (auto flips = 1 + random() % 4; flips > 0; --flips) {
    const auto at = random() % (random() % 2 ? bytes.size() : std::min<std::size_t>(bytes.size(), 200));
    bytes[at] = static_cast<typename Container::value_type>(bytes[at] ^ (1 << random() % 8));
  }
  return bytes;
}

TEST(OctomapFile, DamagedBytesGiveAnErrorOrAGridWithinTheCap) {
  constexpr std::size_t kCap = 8U << 20;
  std::mt19937_64 random(5);
  const TemporaryFile file(".bt");
  int refused = 0;
  for (const auto& content : sample_files()) {
    for (int round = 0; round < 300; ++round) {
      file.write(damaged(content, random));
      const auto grid = load_octomap(file.path(), kCap);
      if (grid) {
        ASSERT_LE(grid->cell_count() * sizeof(Cell), kCap);
      } else {
        ASSERT_TRUE(grid.error().message.starts_with(file.path() + ": "));
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, 100);
}

TEST(OctomapMessage, SurvivesTruncationAndDamage) {
  constexpr std::size_t kCap = 1U << 20;
  std::mt19937_64 random(6);
  const auto tree = tree_of(builtin_scene("narrow-gap", 0.2).value());
  for (const bool binary : {true, false}) {
    std::stringstream stream;
    binary ? tree.writeBinaryData(stream) : tree.writeData(stream);
    const Bytes data = bytes_of(stream);
    for (std::size_t length = 0; length < data.size(); ++length) {
      ASSERT_FALSE(decode_octomap(std::span(data).first(length), 0.2, binary, "OcTree")) << length;
    }
    int refused = 0;
    for (int round = 0; round < 1000; ++round) {
      const auto grid = decode_octomap(damaged(data, random), 0.2, binary, "OcTree", kCap);
      refused += !grid;
      if (grid) {
        ASSERT_LE(grid->cell_count() * sizeof(Cell), kCap);
      }
    }
    EXPECT_GT(refused, 100);
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
      {replaced("id ", "id ColorOcTree\n"), "OcTree"},
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
  const auto written = write_octomap(OccupancyGrid({0, 0, 0}, 0.1, {1, 1, 1}, Cell::free), "/nowhere/at/all.bt");
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().kind, MapError::Kind::cannot_write);
}

class RealMap : public testing::TestWithParam<const char*> {
 protected:
  std::string path() const { return std::string(BACKWASH_SHARED_DATA "/maps/") + GetParam(); }
};

TEST_P(RealMap, EqualsLiboctomapsReading) {
  if (!std::filesystem::exists(path())) GTEST_SKIP() << path() << " is absent";
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
  const std::string path = BACKWASH_SHARED_DATA "/maps/geb079.bt";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is absent";
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

}  // namespace
}  // namespace backwash::map
