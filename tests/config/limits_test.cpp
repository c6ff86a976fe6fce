// SPDX-License-Identifier: BSD-3-Clause
// Where the ranges of single keys end, from both sides.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "core/config/daemon_config.hpp"

namespace backwash::config {
namespace {

std::string shipped(const std::string& name) {
  std::ifstream in(std::string(BACKWASH_SOURCE_DIR "/core/config/files/") + name);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Loads the shipped file with the number behind `key = ` replaced; the error, "" if it is taken.
template <typename Load>
std::string error_with(const Load& load, const std::string& file, const std::string& key, const std::string& value) {
  std::string text = shipped(file);
  const std::size_t at = text.find("\n" + key + " = ");
  EXPECT_NE(at, std::string::npos) << key;
  const std::size_t from = at + key.size() + 4;
  const std::size_t to = std::min(text.find('#', from), text.find('\n', from));
  text.replace(from, to - from, value + " ");
  const std::string path = testing::TempDir() + "backwash_limits_test_" + std::to_string(getpid()) + ".toml";
  std::ofstream(path) << text;
  const auto read = load(path);
  std::filesystem::remove(path);
  return read ? std::string() : read.error().message;
}

struct Limit {
  const char *key, *taken, *refused;
};

TEST(Limits, OfTheDaemonsFileEndWhereTheyAreSaidTo) {
  for (const Limit& l : {Limit{"system", "1", "0"},
                         {"system", "250", "251"},
                         {"priority", "0", "-1"},
                         {"priority", "98", "99"},
                         {"cpu", "-1", "-2"},
                         {"cpu", "1023", "1024"},
                         {"domain", "0", "-1"},
                         {"domain", "230", "231"},
                         {"battery_land", "0", "-0.01"},
                         {"battery_land", "1", "1.01"},
                         {"max_mib", "1", "0.9"},
                         {"max_mib", "65536", "65537"},
                         {"closing_speed", "0", "-0.1"},
                         {"closing_speed", "5", "5.1"},
                         {"sensor_range", "0.5", "0.4"},
                         {"sensor_range", "100", "101"},
                         {"baud", "9600", "9599"}}) {
    EXPECT_EQ(error_with(load_daemon, "backwashd.daemon.toml", l.key, l.taken), "") << l.key;
    EXPECT_NE(error_with(load_daemon, "backwashd.daemon.toml", l.key, l.refused).find("needs a number in"),
              std::string::npos)
        << l.key << " = " << l.refused;
  }
}

TEST(Limits, OfTheVehiclesFileEndWhereTheyAreSaidTo) {
  for (const Limit& l : {Limit{"v_max", "20", "20.1"},
                         {"a_max", "30", "30.1"},
                         {"radius", "5", "5.1"},
                         {"diagonal_radius", "5", "5.1"},
                         {"latency", "0.3", "0.31"},
                         {"thr_mdl_fac", "1", "1.01"},
                         {"velocity", "5", "5.1"},
                         // Lengths, masses and limits are above zero; delays and errors may be zero.
                         {"radius", "0.001", "0"},
                         {"mass", "0.001", "0"},
                         {"v_max", "0.001", "0"},
                         {"a_max", "0.001", "0"},
                         {"latency", "0", "-0.001"},
                         {"velocity", "0", "-0.001"}}) {
    EXPECT_EQ(error_with(load_vehicle, "quad-5in.vehicle.toml", l.key, l.taken), "") << l.key;
    EXPECT_NE(error_with(load_vehicle, "quad-5in.vehicle.toml", l.key, l.refused).find("needs a number in"),
              std::string::npos)
        << l.key << " = " << l.refused;
  }
}

// Each axis has a loop of its own: kd > kp·lag without delay (Routh), with a lag of 0.05 s.
TEST(Limits, OfStabilityHoldForEachAxis) {
  const auto error = [](const char* kd) { return error_with(load_vehicle, "quad-5in.vehicle.toml", "kd", kd); };
  EXPECT_EQ(error("{ horizontal = 0.501, vertical = 0.601 }"), "");
  EXPECT_NE(error("{ horizontal = 0.499, vertical = 6.0 }").find("unstable"), std::string::npos);
  EXPECT_NE(error("{ horizontal = 5.5, vertical = 0.599 }").find("unstable"), std::string::npos);
}

TEST(Limits, OfAnEffectEndWhereTheyAreSaidTo) {
  const auto error = [](const std::string& effect) {
    const std::string path = testing::TempDir() + "backwash_limits_test_" + std::to_string(getpid()) + ".toml";
    std::ofstream(path) << shipped("quad-5in.model.toml")
                        << "\n[[extension.term]]\ncause = 'wall'\neffect = [{ kind = " << effect << " }]\n";
    const auto read = load_model(path);
    std::filesystem::remove(path);
    return read ? std::string() : read.error().message;
  };
  EXPECT_EQ(error("'push_to_walls', value = [-10], error = [10], scale = 10"), "");
  EXPECT_EQ(error("'push_to_walls', value = [10], error = [0], scale = 0.01"), "");
  for (const char* wrong : {"'push_to_walls', value = [10.1], error = [0], scale = 1",
                            "'push_to_walls', value = [-10.1], error = [0], scale = 1",
                            "'push_to_walls', value = [1], error = [10.1], scale = 1",
                            "'push_to_walls', value = [1, 1], error = [0], scale = 1",
                            "'push_to_walls', value = [1], error = [0, 0], scale = 1",
                            "'push_to_walls', value = [1], error = [0], scale = 10.1",
                            "'push_to_walls', value = [1], error = [0], scale = 0.009"})
    EXPECT_NE(error(wrong).find("needs a"), std::string::npos) << wrong;
}

TEST(DaemonFile, BelievesADeclaredMapper) {
  for (const bool live : {true, false}) {
    std::string text = shipped("backwashd.daemon.toml");
    text.replace(text.find("live = false"), 12, live ? "live = true" : "live = false");
    const std::string path = testing::TempDir() + "backwash_limits_test_" + std::to_string(getpid()) + ".toml";
    std::ofstream(path) << text;
    const auto read = load_daemon(path);
    std::filesystem::remove(path);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->map.live, live);
  }
}

}  // namespace
}  // namespace backwash::config
