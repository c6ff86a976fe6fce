// SPDX-License-Identifier: BSD-3-Clause
#include "core/config/map_window.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "core/config/daemon_config.hpp"

namespace backwash::config {
namespace {

using testing::HasSubstr;

constexpr const char* kGood = R"(occupied = "rt/rog_map/occ"
free = "rt/rog_map/free"
size_x = 10
size_y = 8
size_z = 4
resolution = 0.1
)";

/// The shipped example with a table [map.window] of these lines.
tl::expected<Daemon, ConfigError> load(const std::string& lines, const std::string& before = "") {
  const auto path = std::filesystem::temp_directory_path() / ("backwash_map_window." + std::to_string(getpid()));
  const std::string shipped = std::string(BACKWASH_SOURCE_DIR) + "/core/config/files/backwashd.daemon.toml";
  std::ifstream in(shipped);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  if (!before.empty()) text.replace(text.find("max_mib = 512"), 13, before);
  std::ofstream(path) << text << "\n[map.window]\n" << lines;
  auto daemon = load_daemon(path.string());
  std::filesystem::remove(path);
  return daemon;
}

std::string refused(std::string lines, const std::string& what = "", const std::string& by = "") {
  if (!what.empty()) lines.replace(lines.find(what), what.size(), by);
  const auto daemon = load(lines);
  return daemon ? "taken" : daemon.error().message;
}

TEST(MapWindow, IsNoneUntilItsTableDeclaresIt) {
  EXPECT_FALSE(load_daemon("builtin:backwashd").value().map.window.declared());
  const auto daemon = load(kGood);
  ASSERT_TRUE(daemon) << daemon.error().message;
  const MapWindow& w = daemon->map.window;
  EXPECT_TRUE(w.declared());
  EXPECT_EQ(w.occupied, "rt/rog_map/occ");
  EXPECT_EQ(w.free, "rt/rog_map/free");
  EXPECT_EQ(w.voxels(), Index3(101, 81, 41));
  EXPECT_EQ(w.world(), Index3(150, 120, 60));
  EXPECT_EQ(w.keep_voxels, 16777216);
}

TEST(MapWindow, IsWholeOrRefusedByTheKeyThatLacks) {
  EXPECT_THAT(refused(kGood, "occupied = \"rt/rog_map/occ\"\n"), HasSubstr("map.window.occupied"));
  for (const char* line : {"size_x = 10\n", "size_y = 8\n", "size_z = 4\n", "resolution = 0.1\n"})
    EXPECT_THAT(refused(kGood, line), HasSubstr(std::string(line).substr(0, 6)));
  EXPECT_EQ(refused(kGood, "free = \"rt/rog_map/free\"\n"), "taken") << "nothing is freed by it then";
}

// What ROG-Map, nvblox and voxblox publish beside occupied voxels.
TEST(MapWindow, ATopicThatByItsNameHoldsSomethingElseIsRefused) {
  EXPECT_THAT(refused(kGood, "rt/rog_map/free", "rt/rog_map/unk"), HasSubstr("map.window.free"));
  EXPECT_THAT(refused(kGood, "rt/rog_map/free", "rt/rog_map/unk"), HasSubstr("cloud of free voxels"));
  for (const char* other :
       {"rt/rog_map/inf_unk", "rt/nvblox_node/static_esdf_pointcloud", "rt/nvblox_node/static_map_slice",
        "rt/voxblox_node/tsdf_pointcloud", "rt/rog_map/frontier"})
    EXPECT_THAT(refused(kGood, "rt/rog_map/occ", other), HasSubstr("map.window.occupied")) << other;
  EXPECT_EQ(refused(kGood, "rt/rog_map/occ", "rt/nvblox_node/static_occupancy"), "taken");
  EXPECT_THAT(refused(kGood, "rt/rog_map/free", "rt/rog_map/occ"), HasSubstr("another topic"));
  EXPECT_THAT(refused(kGood, "rt/rog_map/free", "/rog_map/free"), HasSubstr("ROS 2 topic on the wire"));
}

TEST(MapWindow, OneWhoseWorldDoesNotFitIsRefusedWithTheMemoryThatItNeeds) {
  // 300 x 240 x 60 voxels of 115 bytes: 473.8 MiB; 30 m: 592.2.
  EXPECT_EQ(refused(kGood, "size_x = 10\nsize_y = 8", "size_x = 20\nsize_y = 16"), "taken");
  EXPECT_THAT(refused(kGood, "size_x = 10\nsize_y = 8", "size_x = 25\nsize_y = 16"),
              HasSubstr("map.max_mib of 593 or more"));
  std::string larger = kGood;
  larger.replace(larger.find("size_x = 10\nsize_y = 8"), 22, "size_x = 25\nsize_y = 16");
  EXPECT_TRUE(load(larger, "max_mib = 593"));
  EXPECT_FALSE(load(larger, "max_mib = 592"));
  EXPECT_THAT(refused(std::string(kGood) + "keep_voxels = 335420\n"), HasSubstr("335421 or more"));
  EXPECT_EQ(refused(std::string(kGood) + "keep_voxels = 335421\n"), "taken");
}

}  // namespace
}  // namespace backwash::config
