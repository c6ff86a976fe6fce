// SPDX-License-Identifier: BSD-3-Clause
// ArduPilot's logs: a cut of a real one, with what its simulator knew, and what a card may hold.
#include "core/log/autopilot/dataflash.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>

namespace {

using namespace backwash::log;

const std::string kFlight = BACKWASH_SOURCE_DIR "/tests/data/ardupilot/door.bin";
const std::string kTruth = BACKWASH_SOURCE_DIR "/tests/data/ardupilot/door_truth.csv";

std::vector<std::uint8_t> flight_bytes() {
  std::ifstream file(kFlight, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// A column of the truth at a time, linear between its rows.
double at(const FlightLog& log, const std::string& name, double t) {
  const auto next = std::ranges::upper_bound(log.t_s, t);
  const auto k =
      static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(next - log.t_s.begin(), 1, std::ssize(log.t_s) - 1));
  const double share = (t - log.t_s[k - 1]) / (log.t_s[k] - log.t_s[k - 1]);
  return (1 - share) * log.column(name)[k - 1] + share * log.column(name)[k];
}

double rms(const FlightLog& log, const FlightLog& truth, const std::string& name, double offset = 0) {
  double sum = 0;
  for (std::size_t k = 0; k < log.t_s.size(); ++k)
    sum += std::pow(log.column(name)[k] - offset - at(truth, name, log.t_s[k]), 2);
  return std::sqrt(sum / static_cast<double>(log.t_s.size()));
}

// 4 m through a door at 1.1 m/s, turning with the way: a wrong axis, sign or unit is metres, not millimetres.
TEST(Dataflash, ARealFlightIsWhereItsSimulatorSaysItWas) {
  const auto log = read_dataflash(kFlight), truth = read_csv(kTruth);
  ASSERT_TRUE(log) << log.error().message;
  ASSERT_TRUE(truth) << truth.error().message;
  EXPECT_NEAR(static_cast<double>(log->t_s.size()) / log->t_s.back(), 25, 1);
  for (const auto& [name, most] : {std::pair{"x_m", 0.01},
                                   {"y_m", 0.01},
                                   {"vx_mps", 0.02},
                                   {"vy_mps", 0.02},
                                   {"vz_mps", 0.02},
                                   {"ax_mps2", 0.1},
                                   {"ay_mps2", 0.1},
                                   {"az_mps2", 0.05}})
    EXPECT_LT(rms(*log, *truth, name), most) << name;
  EXPECT_LT(rms(*log, *truth, "z_m", 0.25), 0.01) << "the estimator began 0.25 m lower";
  double worst = 0;
  for (std::size_t k = 0; k < log->t_s.size(); ++k) {
    const auto q = [&](auto&& part) { return Eigen::Quaterniond(part("qw"), part("qx"), part("qy"), part("qz")); };
    const auto ours = q([&](const char* c) { return log->column(c)[k]; });
    const auto real = q([&](const char* c) { return at(*truth, c, log->t_s[k]); });
    worst = std::max(worst, ours.angularDistance(real.normalized()));
  }
  EXPECT_LT(worst, 0.05) << "rad; 0.15 where the latest of the messages at 10 Hz is held";
}

TEST(Dataflash, CommandsThrustMotorsAndBatteryAreThere) {
  const auto log = read_dataflash(kFlight);
  ASSERT_TRUE(log) << log.error().message;
  for (std::size_t k = 0; k < log->t_s.size(); ++k) {
    const Eigen::Vector3d behind(log->column("cmd_x_m")[k] - log->column("x_m")[k],
                                 log->column("cmd_y_m")[k] - log->column("y_m")[k],
                                 log->column("cmd_z_m")[k] - log->column("z_m")[k]);
    ASSERT_LT(behind.norm(), 0.2) << log->t_s[k];
    ASSERT_NEAR(log->column("thrust")[k], 0.35, 0.05);
    ASSERT_NEAR(log->column("motor4")[k], 0.59, 0.1);
    ASSERT_NEAR(log->column("battery_v")[k], 12.6, 0.01);
  }
}

// As another reader gives them (pymavlink's DFReader): the first row of each in the file.
TEST(Dataflash, FieldsAreWhatAnotherReaderReads) {
  const auto log = decode_dataflash(flight_bytes());
  ASSERT_TRUE(log) << log.error();
  EXPECT_TRUE(log->loss.words().empty());
  const auto first = [&](const char* topic, const char* field) { return log->find(topic)->columns.at(field).front(); };
  EXPECT_EQ(log->find("XKF1")->t_s.size() + log->find("XKF1", 1)->t_s.size(), 170u);
  EXPECT_EQ(log->find("IMU")->t_s.size() + log->find("IMU", 1)->t_s.size(), 426u);
  EXPECT_NEAR(log->find("ATT")->t_s.front(), 36.779449, 1e-9);
  EXPECT_NEAR(first("ATT", "Yaw"), 325.65, 1e-9);
  EXPECT_NEAR(first("ATT", "DesPitch"), 1.75, 1e-9);
  EXPECT_NEAR(first("XKF1", "PN"), 4.1934099197387695, 1e-12);
  EXPECT_NEAR(first("XKF1", "OH"), 488.25, 1e-9);
  EXPECT_NEAR(first("PSCE", "TPE"), 3.0089192390441895, 1e-12);
  EXPECT_NEAR(first("RCOU", "C3"), 1587, 0);
  EXPECT_NEAR(first("CTUN", "ThO"), 0.34981584548950195, 1e-12);
  EXPECT_TRUE(std::isnan(first("CTUN", "DSAlt")));
}

TEST(Dataflash, DamageIsSkipped) {
  const auto whole = flight_bytes();
  ASSERT_FALSE(whole.empty());
  auto hurt = whole;
  std::fill_n(hurt.begin() + 30000, 500, std::uint8_t{0});
  const auto log = decode_dataflash(hurt), sound = decode_dataflash(whole);
  ASSERT_TRUE(log && sound);
  EXPECT_EQ(log->loss.places(), 1u);
  const auto rows = [](const TopicLog& of) { return of.find("IMU")->t_s.size(); };
  EXPECT_LT(rows(*log), rows(*sound));
  EXPECT_GT(rows(*log), rows(*sound) - 8);
}

TEST(Dataflash, WhatIsMissingIsSaid) {
  const std::string text = "no log at all";
  const auto none = decode_dataflash({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error(), "no format message (FMT); give a .bin file of ArduPilot");
  EXPECT_EQ(read_dataflash("/nowhere.bin").error().kind, LogError::Kind::not_found);
}

}  // namespace
