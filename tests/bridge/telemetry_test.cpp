// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/telemetry.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <numbers>

namespace backwash::firmware_bridge::test {
namespace {

using namespace std::chrono_literals;
const Time kMoment = Time{} + 5s;

mavlink::Heartbeat heartbeat(std::uint8_t autopilot, std::uint8_t base_mode, std::uint32_t custom_mode) {
  return {.custom_mode = custom_mode, .autopilot = autopilot, .base_mode = base_mode, .system_status = 4};
}

TEST(Telemetry, HoldsNothingThatNeverCame) {
  const Telemetry t;
  EXPECT_FALSE(t.status.at(kMoment) || t.local_state.at(kMoment) || t.attitude.at(kMoment) ||
               t.reset_counter.at(kMoment) || t.battery.at(kMoment) || t.landed_state.at(kMoment));
  EXPECT_FALSE(t.result_of(400));
}

// docs/faults.md row 56: whoever reads has to bear that it is unknown.
TEST(Telemetry, TellsNothingBeyondItsUseBy) {
  Telemetry t;
  t.take(heartbeat(12, 0x81, 0), kMoment);
  t.take(mavlink::LocalPositionNed{.time_boot_ms = 1}, kMoment);
  t.take(mavlink::AttitudeQuaternion{.time_boot_ms = 1, .q1 = 1}, kMoment);
  mavlink::Odometry odometry{};
  odometry.pose_covariance[0] = 0.01F;
  t.take(odometry, kMoment);
  t.take(mavlink::BatteryStatus{.battery_remaining = 50}, kMoment);
  t.take(mavlink::ExtendedSysState{.landed_state = 1}, kMoment);
  const auto known_for = [](const auto& fact) {
    EXPECT_EQ(fact.age(kMoment + 1h), 1h);
    auto ms = 0ms;
    while (fact.at(kMoment + ms)) ms += 100ms;
    return ms - 100ms;
  };
  EXPECT_EQ(known_for(t.status), 1500ms);
  EXPECT_EQ(known_for(t.landed_state), 1500ms);
  EXPECT_EQ(known_for(t.reset_counter), 1500ms);
  EXPECT_EQ(known_for(t.position_sigma), 1500ms);
  EXPECT_EQ(known_for(t.local_state), 1000ms);
  EXPECT_EQ(known_for(t.attitude), 1000ms);
  EXPECT_EQ(known_for(t.battery), 5000ms);
}

TEST(Telemetry, TellsOffboardAndGuidedFromOtherModes) {
  const auto follows = [](const mavlink::Heartbeat& m) {
    Telemetry t;
    t.take(m, kMoment);
    return t.status.at(kMoment)->value.follows_setpoints;
  };
  EXPECT_TRUE(follows(heartbeat(12, 0x81, 6 << 16)));              // PX4 offboard
  EXPECT_FALSE(follows(heartbeat(12, 0x81, 3 << 16)));             // PX4 position
  EXPECT_FALSE(follows(heartbeat(12, 0x80, 6 << 16)));             // custom mode not in use
  EXPECT_FALSE(follows(heartbeat(12, 0x81, 4 << 16 | 6U << 24)));  // PX4 auto land: the 6 is a sub mode
  EXPECT_TRUE(follows(heartbeat(3, 0x81, 4)));                     // Copter guided
  EXPECT_FALSE(follows(heartbeat(3, 0x81, 6 << 16)));
  EXPECT_FALSE(follows(heartbeat(3, 0x81, 9)));  // Copter land
  EXPECT_FALSE(follows(heartbeat(0, 0x81, 4)));  // some other autopilot
}

TEST(Telemetry, ReadsTheArmedBit) {
  Telemetry t;
  t.take(heartbeat(12, 0x81, 0), kMoment);
  EXPECT_TRUE(t.status.at(kMoment)->value.armed);
  t.take(heartbeat(12, 0x7F, 0), kMoment + 1s);
  EXPECT_FALSE(t.status.at(kMoment)->value.armed);
  EXPECT_EQ(t.status.at(kMoment)->at, kMoment + 1s);
}

TEST(Telemetry, ConvertsPositionAndVelocityToZUp) {
  Telemetry t;
  t.take(mavlink::LocalPositionNed{10, 1, 2, -3, 0.1F, 0.2F, -0.3F}, kMoment);
  // North 1, east 2, 3 above: x east, y north.
  EXPECT_TRUE(t.local_state.at(kMoment)->value.p_W.isApprox(Vec3(2, 1, 3)));
  EXPECT_TRUE(t.local_state.at(kMoment)->value.v_W.isApprox(Vec3(0.2F, 0.1F, 0.3F)));
}

TEST(Telemetry, ConvertsBothAttitudeMessagesToTheSameAttitude) {
  // 30° to the right of north, nose 20° up, right side 10° down.
  const double roll = 10 * std::numbers::pi / 180, pitch = 20 * std::numbers::pi / 180,
               yaw = 30 * std::numbers::pi / 180;
  Telemetry a, b;
  a.take(mavlink::Attitude{1, static_cast<float>(roll), static_cast<float>(pitch), static_cast<float>(yaw), 1, 2, 3},
         kMoment);
  const double cr = std::cos(roll / 2), sr = std::sin(roll / 2), cp = std::cos(pitch / 2), sp = std::sin(pitch / 2),
               cy = std::cos(yaw / 2), sy = std::sin(yaw / 2);
  const auto f = [](double x) { return static_cast<float>(x); };
  b.take(mavlink::AttitudeQuaternion{1, f(cr * cp * cy + sr * sp * sy), f(sr * cp * cy - cr * sp * sy),
                                     f(cr * sp * cy + sr * cp * sy), f(cr * cp * sy - sr * sp * cy), 1, 2, 3},
         kMoment);
  for (const auto* t : {&a, &b}) {
    const Mat3 R = t->attitude.at(kMoment)->value.q_LB.toRotationMatrix();
    // The nose points cos(20°) along the heading and sin(20°) up; east is x.
    const Vec3 nose(std::cos(pitch) * std::sin(yaw), std::cos(pitch) * std::cos(yaw), std::sin(pitch));
    EXPECT_LT((R.col(0) - nose).norm(), 1e-6);
    // Rolled right, the left side rises: its height is sin(roll) cos(pitch).
    EXPECT_NEAR(R(2, 1), std::sin(roll) * std::cos(pitch), 1e-6);
    EXPECT_TRUE(t->attitude.at(kMoment)->value.omega_B.isApprox(Vec3(1, -2, -3)));
  }
}

TEST(Telemetry, DropsAndCountsWhatCannotBe) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  Telemetry t;
  t.take(mavlink::LocalPositionNed{1, nan, 0, 0, 0, 0, 0}, kMoment);
  t.take(mavlink::LocalPositionNed{1, 0, 0, 0, 0, 0, std::numeric_limits<float>::infinity()}, kMoment);
  t.take(mavlink::AttitudeQuaternion{1, 0, 0, 0, 0, 0, 0, 0}, kMoment);
  t.take(mavlink::AttitudeQuaternion{1, nan, 0, 0, 0, 0, 0, 0}, kMoment);
  t.take(mavlink::Attitude{1, nan, 0, 0, 0, 0, 0}, kMoment);
  t.take(mavlink::ExtendedSysState{0, 9}, kMoment);
  EXPECT_EQ(t.broken, 6U);
  EXPECT_FALSE(t.local_state.at(kMoment) || t.attitude.at(kMoment) || t.landed_state.at(kMoment));
}

// Finite numbers that no vehicle indoors has: float's largest, and just beyond the bounds.
TEST(Telemetry, DropsAndCountsWhatNoVehicleReaches) {
  constexpr float kMax = std::numeric_limits<float>::max();
  Telemetry t;
  for (const float far : {kMax, -kMax, 10'001.0F}) t.take(mavlink::LocalPositionNed{1, 0, far, 0, 0, 0, 0}, kMoment);
  for (const float fast : {kMax, -kMax, 101.0F}) t.take(mavlink::LocalPositionNed{1, 0, 0, 0, 0, 0, fast}, kMoment);
  for (const float fast : {kMax, 101.0F}) {
    t.take(mavlink::AttitudeQuaternion{.time_boot_ms = 1, .q1 = 1, .yawspeed = fast}, kMoment);
    t.take(mavlink::Attitude{.time_boot_ms = 1, .rollspeed = fast}, kMoment);
  }
  EXPECT_EQ(t.broken, 10U);
  EXPECT_FALSE(t.local_state.at(kMoment) || t.attitude.at(kMoment));
  t.take(mavlink::LocalPositionNed{1, 9'999, 0, 0, 0, 99, 0}, kMoment);
  EXPECT_TRUE(t.local_state.at(kMoment));
}

// The frames may come apart by three times of it in flight.
TEST(Telemetry, TheErrorOfThePositionIsThatOfItsWorstAxis) {
  Telemetry t;
  for (const std::size_t axis : {0U, 6U, 11U}) {
    mavlink::Odometry m{};
    m.pose_covariance[0] = m.pose_covariance[6] = m.pose_covariance[11] = 0.0001F;
    m.pose_covariance[axis] = 0.04F;
    t.take(m, kMoment);
    ASSERT_TRUE(t.position_sigma.at(kMoment));
    EXPECT_NEAR(t.position_sigma.at(kMoment)->value, 0.2, 1e-6) << axis;
  }
}

// Flags of real firmwares at rest on the ground, before their odometry came and with it.
TEST(Telemetry, AnEstimatorFollowsWhereASensorAidsItAlsoAtRest) {
  Telemetry t;
  const auto px4 = [&](std::uint16_t flags) {
    t.take(mavlink::EstimatorStatus{.flags = flags}, kMoment);
    return t.estimator_follows.at(kMoment)->value;
  };
  EXPECT_FALSE(px4(193)) << "1.15.4";
  EXPECT_TRUE(px4(895)) << "1.15.4";
  EXPECT_FALSE(px4(1253)) << "1.16.1";
  EXPECT_FALSE(px4(229)) << "1.17.0-beta1";
  EXPECT_TRUE(px4(1023)) << "1.16.1 and 1.17.0-beta1";
  const auto arducopter = [&](std::uint16_t flags) {
    t.take(mavlink::EkfStatusReport{.flags = flags}, kMoment);
    return t.estimator_follows.at(kMoment)->value;
  };
  EXPECT_FALSE(arducopter(1024)) << "4.6.3 and 4.7";
  EXPECT_TRUE(arducopter(831)) << "4.6.3 and 4.7";
}

TEST(Telemetry, DropsSwappedPacketsButFollowsARestartedClock) {
  Telemetry t;
  const auto position_at = [](std::uint32_t ms, float x) {
    return mavlink::LocalPositionNed{.time_boot_ms = ms, .x = x};
  };
  t.take(position_at(5020, 2), kMoment);
  t.take(position_at(5000, 1), kMoment);
  EXPECT_EQ(t.local_state.at(kMoment)->value.p_W.y(), 2);
  EXPECT_EQ(t.out_of_order, 1U);
  t.take(position_at(100, 7), kMoment);
  EXPECT_EQ(t.local_state.at(kMoment)->value.p_W.y(), 7) << "4.9 s back: the controller restarted";
  t.take(position_at(0xFFFFFFFF, 8), kMoment);
  EXPECT_EQ(t.local_state.at(kMoment)->value.p_W.y(), 7);
  t.take(position_at(0xFFFFFFFFU - 100'000, 9), kMoment);
  t.take(position_at(20, 10), kMoment);
  EXPECT_EQ(t.local_state.at(kMoment)->value.p_W.y(), 10) << "the sender's counter may wrap";
}

// A watchdog's restart may be over before the heartbeat is missed.
TEST(Telemetry, ARestartThatTheClockTellsForgetsWhatMayBeOtherwiseNow) {
  for (const bool by_attitude : {false, true}) {
    Telemetry t;
    const auto say = [&](std::uint32_t ms) {
      if (by_attitude) t.take(mavlink::AttitudeQuaternion{.time_boot_ms = ms, .q1 = 1}, kMoment);
      if (!by_attitude) t.take(mavlink::LocalPositionNed{.time_boot_ms = ms}, kMoment);
    };
    mavlink::ParamValue answer{.param_value = 0.3F, .param_type = 9};
    std::ranges::copy(std::string_view("GUID_TIMEOUT"), answer.param_id.begin());
    t.take(mavlink::Heartbeat{0, 2, 3, 0, 3}, kMoment);
    const auto& told = t.parameters()[0].value;  // of GUID_TIMEOUT
    say(60'000);
    t.take(answer, kMoment);
    t.take(mavlink::GpsGlobalOrigin{}, kMoment);
    say(59'500);
    EXPECT_TRUE(told && t.has_origin) << "a late packet";
    say(900);
    EXPECT_FALSE(told);
    EXPECT_FALSE(t.has_origin);
    t.take(answer, kMoment);
    say(920);
    EXPECT_TRUE(told);
  }
}

TEST(Telemetry, AddsUpCellsAndLeavesAbsentValuesAbsent) {
  Telemetry t;
  t.take(mavlink::SysStatus{.voltage_battery = 65535, .battery_remaining = -1}, kMoment);
  EXPECT_FALSE(t.battery.at(kMoment));
  t.take(mavlink::SysStatus{.voltage_battery = 12600, .current_battery = -1, .battery_remaining = -1}, kMoment);
  EXPECT_DOUBLE_EQ(*t.battery.at(kMoment)->value.voltage, 12.6);
  EXPECT_FALSE(t.battery.at(kMoment)->value.remaining || t.battery.at(kMoment)->value.current);
  t.take(mavlink::SysStatus{.voltage_battery = 12600, .current_battery = 250, .battery_remaining = -1}, kMoment);
  EXPECT_DOUBLE_EQ(*t.battery.at(kMoment)->value.current, 2.5);
  mavlink::BatteryStatus b{.current_battery = -1250, .battery_remaining = 47};
  b.voltages.fill(65535);
  b.voltages[0] = 4200;
  b.voltages[1] = 4100;
  t.take(b, kMoment);
  EXPECT_DOUBLE_EQ(*t.battery.at(kMoment)->value.voltage, 8.3);
  EXPECT_DOUBLE_EQ(*t.battery.at(kMoment)->value.remaining, 0.47);
  EXPECT_DOUBLE_EQ(*t.battery.at(kMoment)->value.current, -12.5) << "it is charged";
  b.current_battery = -1;
  t.take(b, kMoment);
  EXPECT_FALSE(t.battery.at(kMoment)->value.current);
  t.take(mavlink::SysStatus{.voltage_battery = 1, .battery_remaining = 1}, kMoment);
  EXPECT_DOUBLE_EQ(*t.battery.at(kMoment)->value.voltage, 8.3) << "BATTERY_STATUS goes before SYS_STATUS";
  b.id = 1;
  b.battery_remaining = 3;
  t.take(b, kMoment);
  EXPECT_DOUBLE_EQ(*t.battery.at(kMoment)->value.remaining, 0.47) << "a second battery is not the flight battery";
}

TEST(Telemetry, KeepsTheNewestAnswerToEachCommand) {
  Telemetry t;
  t.take(mavlink::CommandAck{.command = 400, .result = 1}, kMoment);
  t.take(mavlink::CommandAck{.command = 176, .result = 2}, kMoment);
  t.take(mavlink::CommandAck{.command = 400, .result = 0}, kMoment + 1s);
  EXPECT_EQ(t.result_of(400)->value.result, 0);
  EXPECT_EQ(t.result_of(400)->at, kMoment + 1s);
  EXPECT_EQ(t.result_of(176)->value.result, 2);
  EXPECT_FALSE(t.result_of(21));
}

TEST(Telemetry, TerminatesATextOfFullLength) {
  Telemetry t;
  mavlink::Statustext m{.severity = 3};
  m.text.fill('x');
  t.take(m, kMoment);
  EXPECT_EQ(std::string(t.text->value.text.data()), std::string(50, 'x'));
}

}  // namespace
}  // namespace backwash::firmware_bridge::test
