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

std::string file_text() {
  std::ifstream in(std::string(BACKWASH_SOURCE_DIR) + "/core/config/files/backwashd.daemon.toml");
  return {std::istreambuf_iterator<char>(in), {}};
}

tl::expected<Daemon, ConfigError> load_text(const std::string& text) {
  const auto path = std::filesystem::temp_directory_path() / ("backwash_map_window." + std::to_string(getpid()));
  std::ofstream(path) << text;
  auto daemon = load_daemon(path.string());
  std::filesystem::remove(path);
  return daemon;
}

/// The shipped example with a table [map.window] of these lines.
tl::expected<Daemon, ConfigError> load(const std::string& lines, const std::string& before = "") {
  std::string text = file_text();
  if (!before.empty()) text.replace(text.find("max_mib = 512"), 13, before);
  return load_text(text + "\n[map.window]\n" + lines);
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

// Over a floor that is taken for granted alone the air is calmer than modelled, and over one that is there it is not:
// both are of one class of air, so what the one shows may shrink no set above the other.
TEST(MapWindow, SetsShrinkByCalmerAirWithoutAWindowAlone) {
  const std::string text = file_text();
  const auto with = [&](const std::string& lines, bool window) {
    std::string changed = text;
    changed.replace(changed.find("enabled = false"), 15, lines);
    return load_text(changed + (window ? "\n[map.window]\n" + std::string(kGood) : ""));
  };
  const auto both = with("enabled = true\ncalmest = 0.3", true);
  ASSERT_FALSE(both);
  EXPECT_THAT(both.error().message, HasSubstr("key 'adaptation.calmest'"));
  EXPECT_THAT(both.error().message, HasSubstr("0.3"));
  EXPECT_THAT(both.error().message, HasSubstr("needs 1 with map.window"));
  EXPECT_TRUE(with("enabled = true\ncalmest = 0.3", false));
  EXPECT_TRUE(with("enabled = true\ncalmest = 1", true));
  EXPECT_TRUE(with("enabled = true", true)) << "sets that only grow are right over any floor";
  EXPECT_TRUE(with("enabled = false\ncalmest = 0.3", true)) << "nothing is learnt";
}

}  // namespace
}  // namespace backwash::config
