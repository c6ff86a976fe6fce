// SPDX-License-Identifier: BSD-3-Clause
// What an autopilot's log says is not valid, not a quadrotor's, or of the older estimator.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "core/log/autopilot/airframe.hpp"
#include "core/log/autopilot/dataflash.hpp"
#include "core/log/autopilot/same_flight.hpp"
#include "core/log/kinds/recording.hpp"

namespace {

using namespace backwash::log;

/// Positions at 50 Hz, 400 of them, with four motors.
TopicLog flown() {
  TopicLog::Topic position{"vehicle_local_position", 0, {}, {}}, motors{"actuator_motors", 0, {0}, {}};
  for (int k = 0; k < 400; ++k) {
    position.t_s.push_back(0.02 * k);
    for (const char* name : {"x", "y", "z", "vx", "vy", "vz"}) position.columns[name].push_back(std::sin(0.01 * k));
    for (const char* name : {"xy_valid", "z_valid", "v_xy_valid", "v_z_valid"}) position.columns[name].push_back(1);
  }
  for (int i = 0; i < 4; ++i) motors.columns["control[" + std::to_string(i) + "]"].push_back(0.4);
  TopicLog log;
  log.topics = {position, motors};
  return log;
}

bool says(const std::vector<std::string>& notes, const std::string& what) {
  return std::ranges::any_of(notes, [&](const auto& note) { return note.find(what) != note.npos; });
}

TEST(Validity, WhatTheEstimatorCallsNotValidIsLeftOutByNameAndShare) {
  EXPECT_TRUE(flight_of(flown())->notes.empty());
  for (const auto& [flag, words] : {std::pair{"xy_valid", "position along x and y is not valid in 25 %"},
                                    {"z_valid", "height is not valid in 25 %"},
                                    {"v_xy_valid", "velocity along x and y is not valid in 25 %"},
                                    {"v_z_valid", "vertical velocity is not valid in 25 %"}}) {
    auto log = flown();
    std::fill_n(log.topics[0].columns[flag].begin() + 100, 100, 0);
    const auto flight = flight_of(log);
    ASSERT_TRUE(flight) << flight.error();
    EXPECT_EQ(flight->t_s.size(), 300u);
    EXPECT_TRUE(std::ranges::none_of(flight->t_s, [](double t) { return t > 1.99 && t < 3.99; })) << flag;
    EXPECT_TRUE(says(flight->notes, words)) << flight->notes.front();
    log.topics[0].columns[flag].assign(400, 0);
    const auto none = flight_of(log);
    ASSERT_FALSE(none);
    EXPECT_NE(none.error().find("is not valid in 100 %"), std::string::npos) << none.error();
  }
}

TEST(Validity, RowsBetweenRarePositionsDoNotBridgeWhatIsNotValid) {
  TopicLog log = flown();
  auto& position = log.topics[0];
  TopicLog::Topic rare{position.name, 0, {}, {}}, force{"vehicle_acceleration", 0, {}, {}},
      attitude{"vehicle_attitude", 0, {}, {}};
  for (std::size_t k = 0; k < 400; k += 5) {  // 10 Hz
    rare.t_s.push_back(position.t_s[k]);
    for (const auto& [name, column] : position.columns) rare.columns[name].push_back(column[k]);
  }
  for (int k = 0; k < 800; ++k) {
    force.t_s.push_back(0.01 * k);
    attitude.t_s.push_back(0.01 * k);
    for (int i = 0; i < 3; ++i) force.columns["xyz[" + std::to_string(i) + "]"].push_back(i == 2 ? -9.8 : 0);
    for (int i = 0; i < 4; ++i) attitude.columns["q[" + std::to_string(i) + "]"].push_back(i == 0 ? 1 : 0);
  }
  rare.columns["xy_valid"][20] = rare.columns["xy_valid"][21] = 0;  // at 2.0 and 2.1 s
  log.topics = {rare, force, attitude};
  const auto flight = flight_of(log);
  ASSERT_TRUE(flight) << flight.error();
  ASSERT_GT(flight->t_s.size(), 600u);
  const double begin = 0.01;  // of the first row
  EXPECT_TRUE(std::ranges::none_of(flight->t_s, [&](double t) { return t + begin > 1.91 && t + begin < 2.19; }));
}

TEST(Validity, AVehicleThatIsNoMulticopterIsRefusedByName) {
  const auto with = [](const char* field, double value) {
    auto log = flown();
    log.topics.push_back({"vehicle_status", 0, {0, 1, 2}, {{field, {0, value, value}}}});
    return flight_of(log);
  };
  const auto parameter = [](const char* name, double value) {
    auto log = flown();
    log.parameters[name] = value;
    return flight_of(log);
  };
  EXPECT_NE(with("vehicle_type", 2).error().find("a fixed wing (vehicle_type 2)"), std::string::npos);
  EXPECT_NE(with("vehicle_type", 3).error().find("a rover"), std::string::npos);
  EXPECT_NE(with("is_vtol", 1).error().find("a VTOL"), std::string::npos);
  EXPECT_NE(with("system_type", 12).error().find("a submarine"), std::string::npos);
  EXPECT_NE(parameter("MAV_TYPE", 10).error().find("a rover"), std::string::npos);
  EXPECT_NE(parameter("CA_AIRFRAME", 4).error().find("a VTOL"), std::string::npos);
  EXPECT_NE(parameter("FRAME_CLASS", 6).error().find("a helicopter"), std::string::npos);
  auto plane = flown();
  plane.texts = {"ArduPlane V4.5.1 (abcdef)"};
  EXPECT_NE(flight_of(plane).error().find("a fixed wing"), std::string::npos);
  EXPECT_TRUE(with("vehicle_type", 1));
  EXPECT_TRUE(parameter("MAV_TYPE", 2));
}

TEST(Validity, MotorsOfOtherThanFourAreLeftOutAndTold) {
  const auto rotors = [](const char* name, double value, const char* text = nullptr) {
    auto log = flown();
    if (name) log.parameters[name] = value;
    if (text) log.texts = {text};
    return *flight_of(log);
  };
  for (const auto& flight : {rotors("MAV_TYPE", 13), rotors("CA_ROTOR_COUNT", 6), rotors("FRAME_CLASS", 2),
                             rotors(nullptr, 0, "Frame: HEXA/X")}) {
    EXPECT_FALSE(flight.has("motor1"));
    EXPECT_TRUE(says(flight.notes, "it has 6 rotors: its motors are left out"));
  }
  EXPECT_TRUE(says(rotors("FRAME_CLASS", 3).notes, "8 rotors"));
  EXPECT_TRUE(rotors("FRAME_CLASS", 1).has("motor4"));
}

/// ArduPilot's messages of an estimator of 20 Hz: NKF1 or XKF1, and its status.
TopicLog ardupilot(const std::string& ekf, unsigned status) {
  TopicLog::Topic one{ekf + "1", 0, {}, {}}, four{ekf + "4", 0, {}, {}};
  for (int k = 0; k < 200; ++k) {
    one.t_s.push_back(0.05 * k);
    four.t_s.push_back(0.05 * k);
    for (const char* name : {"PN", "PE", "PD", "VN", "VE", "VD"}) one.columns[name].push_back(0.01 * k);
    four.columns["SS"].push_back(k < 100 ? 0x3f : status);
    four.columns["PI"].push_back(0);
  }
  TopicLog log;
  log.topics = {one, four};
  return log;
}

TEST(Validity, OfArduPilotsConstantPositionModeNothingIsTaken) {
  for (const char* ekf : {"XKF", "NKF"}) {
    const auto sound = flight_of(px4_names(ardupilot(ekf, 0x3f)));
    ASSERT_TRUE(sound) << sound.error();
    EXPECT_EQ(sound->t_s.size(), 200u);
    const auto half = flight_of(px4_names(ardupilot(ekf, 0x3f | 0x80)));
    ASSERT_TRUE(half) << half.error();
    EXPECT_EQ(half->t_s.size(), 100u);
    EXPECT_TRUE(says(half->notes, "position along x and y is not valid in 50 %"));
    const auto low = flight_of(px4_names(ardupilot(ekf, 0x1f)));  // no height
    ASSERT_TRUE(low) << low.error();
    EXPECT_TRUE(says(low->notes, "height is not valid in 50 %"));
    EXPECT_FALSE(says(low->notes, "ArduPilot"));
  }
}

TEST(Validity, TheEstimatorAndCoreThatFlewAreTaken) {
  auto both = ardupilot("XKF", 0x3f);
  const auto older = ardupilot("NKF", 0x3f);
  both.topics.insert(both.topics.end(), older.topics.begin(), older.topics.end());
  for (double& north : both.topics[2].columns["PN"]) north += 100;
  EXPECT_LT(flight_of(px4_names(both))->column("y_m").front(), 1) << "EKF3 where nothing else is said";
  both.parameters["AHRS_EKF_TYPE"] = 2;
  EXPECT_GT(flight_of(px4_names(both))->column("y_m").front(), 99);
  // Core 1 of before Copter 4.1 is called NKF6.
  auto second = older;
  second.topics.push_back(second.topics[0]);
  second.topics.back().name = "NKF6";
  for (double& north : second.topics.back().columns["PN"]) north += 50;
  second.topics[1].columns["PI"].assign(200, 1);
  EXPECT_GT(flight_of(px4_names(second))->column("y_m").front(), 49);
}

/// Files of users (shared/data/field); skipped by name where they are not there.
TEST(Validity, FieldLogsAreReadOrLeftOutByName) {
  const std::string folder = BACKWASH_SOURCE_DIR "/../shared/data/field/";
  if (!std::ifstream(folder + "flight.ulg")) GTEST_SKIP() << "data: no " << folder << "flight.ulg";
  const auto invalid = read_recording(folder + "all_invalid.ulg");
  ASSERT_FALSE(invalid);
  EXPECT_NE(invalid.error().message.find("position along x and y is not valid in 100 %"), std::string::npos)
      << invalid.error().message;
  const auto flight = read_recording(folder + "flight.ulg"), copter = read_recording(folder + "copter364.bin");
  ASSERT_TRUE(flight) << flight.error().message;
  EXPECT_TRUE(flight->notes.empty()) << flight->notes.front();
  ASSERT_TRUE(copter) << copter.error().message;
  EXPECT_TRUE(copter->has("qw") && copter->has("ax_mps2") && copter->has("thrust"));
  EXPECT_GT(copter->t_s.size(), 700u);
  KnownFlights known;
  EXPECT_TRUE(known.again("a", FlightMark(*flight)).empty());
  EXPECT_NE(known.again("b", FlightMark(*flight)).find("b:1: 100 % of the positions are those of a"),
            std::string::npos);
  EXPECT_TRUE(known.again("c", FlightMark(*copter)).empty());
}

}  // namespace
