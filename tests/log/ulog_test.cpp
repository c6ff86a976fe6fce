// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

#include "core/log/autopilot/ulog.hpp"
#include "core/log/columns/import_columns.hpp"

namespace {

using namespace backwash::log;

const std::string kFolder = std::string(BACKWASH_RECORDINGS) + "/ulog/";

std::vector<std::uint8_t> bytes_of(const std::string& name) {
  std::ifstream file(kFolder + name, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

TEST(ULogReader, ReadsEveryShippedLogWithSubscriptionsAndAppendedData) {
  for (const auto& entry : std::filesystem::directory_iterator(kFolder)) {
    if (entry.path().extension() != ".ulg") continue;
    const auto log = decode_ulog(bytes_of(entry.path().filename().string()));
    ASSERT_TRUE(log) << entry.path() << ": " << log.error();
    EXPECT_FALSE(log->topics.empty()) << entry.path();
    // One holds a mission of an earlier start: 1194 s in its first second, at 20 s.
    const std::size_t strange = entry.path().filename() == "sample_log_small.ulg" ? 20 : 0;
    EXPECT_EQ(log->loss.skipped(), strange) << entry.path() << ": " << log->loss.words().front();
  }
}

TEST(ULogReader, TurnsARealFlightToZUpWithUnitQuaternionsThatPointTheThrustUp) {
  const std::string path = kFolder + "log_8_2024-2-20-15-42-26.ulg";
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

TEST(ULogReader, RefusesWhatIsNoULog) {
  const std::vector<std::uint8_t> text(100, 'x');
  const auto log = decode_ulog(text);
  ASSERT_FALSE(log);
  EXPECT_TRUE(log.error().starts_with("byte 0: ")) << log.error();
}

/// A craft that swings along north and tilts for it: positions at 5 Hz, accelerometer at 250 Hz, attitude at 100 Hz.
TopicLog swinging() {
  const double size = 0.4, w = 3.0;
  TopicLog log;
  TopicLog::Topic position{"vehicle_local_position", 0, {}, {}}, force{"sensor_combined", 0, {}, {}},
      attitude{"vehicle_attitude", 0, {}, {}};
  for (int k = 0; k < 100; ++k) {
    const double t = 10 + 0.2 * k;
    if (k >= 50 && k < 55) continue;  // a gap
    position.t_s.push_back(t);
    for (const auto& [name, value] : std::map<std::string, double>{{"x", size * std::sin(w * t)},
                                                                   {"y", 2.0},
                                                                   {"z", -1.5},
                                                                   {"vx", size * w * std::cos(w * t)},
                                                                   {"vy", 0.0},
                                                                   {"vz", 0.0}})
      position.columns[name].push_back(value);
  }
  for (int k = 0; k < 2000; ++k) {
    const double t = 10 + 0.01 * k, pitch = std::atan2(size * w * w * std::sin(w * t), 9.80665);
    attitude.t_s.push_back(t);
    attitude.columns["q[0]"].push_back(std::cos(pitch / 2));
    attitude.columns["q[1]"].push_back(0);
    attitude.columns["q[2]"].push_back(std::sin(pitch / 2));
    attitude.columns["q[3]"].push_back(0);
  }
  for (int k = 0; k < 5000; ++k) {
    const double t = 10 + 0.004 * k, a = -size * w * w * std::sin(w * t);
    force.t_s.push_back(t);
    force.columns["accelerometer_m_s2[0]"].push_back(0);
    force.columns["accelerometer_m_s2[1]"].push_back(0);
    force.columns["accelerometer_m_s2[2]"].push_back(-std::hypot(a, 9.80665));
  }
  log.topics = {position, force, attitude};
  return log;
}

TEST(ULogReader, RowsAreTheAccelerometersWherePositionsAreRare) {
  const auto log = flight_of(swinging());
  ASSERT_TRUE(log) << log.error();
  ASSERT_GT(log->t_s.size(), 1500u);
  double longest = 0;
  for (std::size_t row = 0; row < log->t_s.size(); ++row) {
    if (row > 0) longest = std::max(longest, log->t_s[row] - log->t_s[row - 1]);
    // The first row lies 0.004 s after the first message.
    const double t = 10.004 + log->t_s[row];
    ASSERT_NEAR(log->column("y_m")[row], 0.4 * std::sin(3 * t), 2e-3) << row;
    ASSERT_NEAR(log->column("vy_mps")[row], 1.2 * std::cos(3 * t), 0.06) << row;
    ASSERT_NEAR(log->column("ay_mps2")[row], -3.6 * std::sin(3 * t), 0.02) << row;
    ASSERT_NEAR(log->column("az_mps2")[row], 0, 0.02) << row;
    ASSERT_NEAR(log->column("x_m")[row], 2, 1e-12);
  }
  EXPECT_NEAR(longest, 1.2, 0.05) << "the gap stays one";
  TopicLog jumps = swinging();
  jumps.topics[0].columns["xy_reset_counter"].assign(95, 0);
  for (std::size_t k = 20; k < 95; ++k) {
    jumps.topics[0].columns["xy_reset_counter"][k] = 1;
    jumps.topics[0].columns["x"][k] += 5;
  }
  const auto jumped = flight_of(jumps);
  ASSERT_TRUE(jumped);
  for (const double y : jumped->column("y_m")) ASSERT_TRUE(y < 0.41 || y > 4.59) << "between the two";
  TopicLog without = swinging();
  without.topics.pop_back();
  const auto rare = flight_of(without);
  ASSERT_TRUE(rare);
  EXPECT_EQ(rare->t_s.size(), 95u) << "without an attitude the force cannot be turned";
}

TEST(ULogReader, RealFlightsWithRarePositionsHaveRowsEnoughAndNothingContradictsThem) {
  for (const auto& name : {"battery_brownout.ulg", "log_8_2024-2-20-15-42-26.ulg"}) {
    const std::string path = kFolder + name;
    const auto log = read_ulog(path);
    ASSERT_TRUE(log) << log.error().message;
    EXPECT_GT(static_cast<double>(log->t_s.size()) / log->t_s.back(), 50) << name;
    // One estimator jumped by 0.4 m: its velocity is not the derivative there.
    if (path.find("log_8") != std::string::npos) continue;
    for (const auto& doubt : contradictions(*log)) ADD_FAILURE() << name << ": " << doubt.words;
  }
}

// Its estimator had neither GPS nor VIO: 678 positions of 0, 0, each marked as not valid.
TEST(ULogReader, ARealFlightWithoutAPositionIsNone) {
  const auto log = read_ulog(kFolder + "sample.ulg");
  ASSERT_FALSE(log);
  EXPECT_NE(log.error().message.find("position along x and y is not valid in 100 %"), std::string::npos)
      << log.error().message;
}

}  // namespace
