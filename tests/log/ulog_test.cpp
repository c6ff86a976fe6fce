// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include "core/log/ulog.hpp"

namespace {

using namespace backwash::log;

const std::string kFolder = std::string(BACKWASH_SHARED_DATA) + "/ulog/";

std::vector<std::uint8_t> bytes_of(const std::string& name) {
  std::ifstream file(kFolder + name, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

TEST(ULogReader, ReadsEveryShippedLogWithSubscriptionsAndAppendedData) {
  if (!std::filesystem::exists(kFolder)) GTEST_SKIP() << "no " << kFolder;
  for (const auto& entry : std::filesystem::directory_iterator(kFolder)) {
    if (entry.path().extension() != ".ulg") continue;
    const auto log = decode_ulog(bytes_of(entry.path().filename().string()));
    ASSERT_TRUE(log) << entry.path() << ": " << log.error();
    EXPECT_FALSE(log->topics.empty()) << entry.path();
  }
}

TEST(ULogReader, TurnsARealFlightToZUpWithUnitQuaternionsThatPointTheThrustUp) {
  const std::string path = kFolder + "log_8_2024-2-20-15-42-26.ulg";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no " << path;
  const auto log = read_ulog(path);
  ASSERT_TRUE(log) << log.error().message;
  ASSERT_GT(log->t_s.size(), 100u);
  ASSERT_TRUE(log->has("qw"));
  double up = 0;
  for (std::size_t i = 0; i < log->t_s.size(); ++i) {
    const double w = log->column("qw")[i], x = log->column("qx")[i], y = log->column("qy")[i], z = log->column("qz")[i];
    ASSERT_NEAR(w * w + x * x + y * y + z * z, 1, 1e-3);
    up += (1 - 2 * (x * x + y * y)) / static_cast<double>(log->t_s.size());
  }
  EXPECT_GT(up, 0.95);
  // PX4 1.13 logs the collective in the attitude's set-point and its outputs under a later instance.
  ASSERT_TRUE(log->has("thrust"));
  ASSERT_TRUE(log->has("motor4"));
  for (const double u : log->column("thrust")) ASSERT_TRUE(u >= 0 && u <= 1) << u;
}

TEST(ULogReader, SurvivesCorruptFilesAndNamesTheOffset) {
  if (!std::filesystem::exists(kFolder)) GTEST_SKIP() << "no " << kFolder;
  const auto whole = bytes_of("sample_log_small.ulg");
  ASSERT_FALSE(whole.empty());
  std::mt19937 rng(7);
  int refused = 0;
  for (int k = 0; k < 300; ++k) {
    auto bytes = whole;
    if (bytes.size() > 60000) bytes.resize(60000);
    for (int n = 0; n < 1 + k % 20; ++n) bytes[rng() % bytes.size()] = static_cast<std::uint8_t>(rng());
    if (k % 3 == 0) bytes.resize(rng() % bytes.size());
    const auto log = decode_ulog(bytes);
    if (log) continue;
    ++refused;
    EXPECT_TRUE(log.error().starts_with("byte ")) << log.error();
  }
  EXPECT_GT(refused, 30);
}

TEST(ULogReader, RefusesWhatIsNoULog) {
  const std::vector<std::uint8_t> text(100, 'x');
  const auto log = decode_ulog(text);
  ASSERT_FALSE(log);
  EXPECT_TRUE(log.error().starts_with("byte 0: ")) << log.error();
}

}  // namespace
