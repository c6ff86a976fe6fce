// SPDX-License-Identifier: BSD-3-Clause
// Logs that lack columns, and set-points that the craft did not follow: nothing is told that they cannot show.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>

#include "core/study/effects/table.hpp"
#include "core/study/findings/when_it_acts.hpp"
#include "tests/study_worlds/observe.hpp"

namespace lacking {
namespace {

using namespace backwash::study;
using study_worlds::Table;

std::filesystem::path folder() {
  return std::filesystem::temp_directory_path() / ("study-lacking-" + std::to_string(::getpid()));
}

void drop(Table& table, const std::string& name) {
  const auto at = std::find(table.names.begin(), table.names.end(), name) - table.names.begin();
  table.names.erase(table.names.begin() + at);
  for (auto& row : table.rows) row.erase(row.begin() + at);
}

void set(Table& table, const std::string& name, double value) {
  const auto at = std::find(table.names.begin(), table.names.end(), name) - table.names.begin();
  for (auto& row : table.rows) row[static_cast<std::size_t>(at)] = value;
}

/// A world, without an effect unless one is named, each of its logs changed.
template <typename Change>
Observations changed(Change change, std::vector<std::string> effects = {}, double size = 1) {
  const auto world = study_worlds::draw_world({88001, std::move(effects), size, 12, ""});
  auto tables = study_worlds::fly_all(world);
  for (Table& table : tables) change(table);
  auto seen = study_worlds::observe(world, tables, folder());
  std::filesystem::remove_all(folder());
  return seen;
}

std::string told(const Observations& seen) {
  StudyOptions options;
  options.minimum_detectable = false;
  return study_worlds::told(backwash::study::study(seen, options));
}

std::string why_not(const std::string& cause, const Observations& seen) {
  std::string why;
  for (const Form* form : catalogue())
    if (form->cause() == cause) why = why_not_tested(*form, seen).value_or("tested");
  return why;
}

TEST(Lacking, SetPointsThatTheCraftDidNotFollowTellNothing) {
  const auto elsewhere = changed([](Table& table) {
    for (const char* name : {"cmd_x_m", "cmd_y_m", "cmd_z_m"}) set(table, name, 0);  // velocities are commanded
  });
  EXPECT_EQ(told(elsewhere), "nothing");
  EXPECT_EQ(why_not("command_latency", elsewhere), "the craft flew elsewhere than the set-points lead");
  EXPECT_EQ(why_not("command_latency", changed([](Table&) {})), "tested");
}

TEST(Lacking, WithoutTheVoltageASagIsNoDriftOfTheSensorAlone) {
  const auto blind = [](Table& table) { drop(table, "battery_v"); };
  const std::string sagging = told(changed(blind, {"battery_sag"}, 3));
  EXPECT_TRUE(sagging.starts_with("imu_drift|battery_sag")) << sagging;
  EXPECT_EQ(told(changed(blind, {"imu_drift"}, 2)), "imu_drift");
}

TEST(Lacking, WithoutAccelerationTheNoiseOfItsDerivativeIsNoGust) {
  const auto positions = changed([](Table& table) {
    for (const char* name : {"vx_mps", "vy_mps", "vz_mps", "ax_mps2", "ay_mps2", "az_mps2"}) drop(table, name);
  });
  EXPECT_EQ(told(positions), "nothing");
  for (const Channel c : {kVarX, kVarY, kVarZ, kTail}) EXPECT_FALSE(positions.measured(c)) << channel_name(c);
  EXPECT_TRUE(positions.measured(kMeanX));
  EXPECT_EQ(why_not("heavy_tails", positions).substr(0, 17), "no ax_mps2 column");
}

TEST(Lacking, WithoutThrustALateLoopIsNoDrag) {
  const auto seen = changed([](Table& table) { drop(table, "thrust"); });
  EXPECT_EQ(told(seen), "nothing");
  for (const char* cause : {"rotor_drag", "inflow"}) EXPECT_EQ(why_not(cause, seen), "no thrust column");
  EXPECT_EQ(why_not("payload", seen), "tested");
}

/// Without commands a rotor's rpm² is over nothing, and no value of the channel that holds it over the command.
TEST(Lacking, MotorCommandsInSomeFlightsAreAGapInTheOthers) {
  std::size_t flight = 0;
  const auto seen = changed([&](Table& table) {
    if (flight++ >= 6) return;
    for (const char* name : {"motor1", "motor2", "motor3", "motor4"}) drop(table, name);
  });
  EXPECT_EQ(told(seen), "nothing");
  EXPECT_EQ(why_not("rotor_sensor_fault", seen), "tested");
  const auto gaps = not_measured(seen);
  ASSERT_EQ(gaps.size(), 2u);
  EXPECT_EQ(gaps[1].flights, (std::vector<std::size_t>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(to_text(gaps[1], seen.flights), "rpm over command, not measured in all flights; without: up to flight 6");
}

}  // namespace
}  // namespace lacking
