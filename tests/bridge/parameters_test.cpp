// SPDX-License-Identifier: BSD-3-Clause
// Which parameters of the autopilot forbid that the daemon takes control (docs/faults.md row 51).
#include "firmware_bridge/parameters.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <map>

#include "firmware_bridge/line_budget.hpp"
#include "tests/bridge/emulated_controller.hpp"

namespace backwash::firmware_bridge::test {
namespace {

Vehicle vehicle() {
  Vehicle v;
  v.controller.kp = {6.0, 12.0};
  v.controller.kd = {4.0, 8.0};
  v.limits.v_max = 1.5;
  v.limits.a_max = 2.0;
  return v;
}

using Named = std::map<std::string, double, std::less<>>;
const Named kPx4Good{{"COM_OF_LOSS_T", 0.3},  {"COM_OBL_RC_ACT", 4},   {"MPC_XY_VEL_P_ACC", 4},
                     {"MPC_XY_P", 1.5},       {"MPC_Z_VEL_P_ACC", 8},  {"MPC_Z_P", 1.5},
                     {"MPC_XY_VEL_MAX", 1.5}, {"MPC_Z_VEL_MAX_UP", 3}, {"MPC_Z_VEL_MAX_DN", 1.5},
                     {"MPC_TILTMAX_AIR", 45}, {"EKF2_EV_DELAY", 0},    {"NAV_RCL_ACT", 3},
                     {"COM_RC_OVERRIDE", 3},  {"NAV_DLL_ACT", 0},      {"COM_LOW_BAT_ACT", 2},
                     {"EKF2_EV_CTRL", 15},    {"EKF2_HGT_REF", 3}};
const Named kArduPilotGood{
    {"GUID_TIMEOUT", 0.3}, {"PSC_VELXY_P", 4},     {"PSC_POSXY_P", 1.5},    {"PSC_VELZ_P", 8},
    {"PSC_POSZ_P", 1.5},   {"WPNAV_SPEED", 150},   {"WPNAV_SPEED_UP", 250}, {"WPNAV_SPEED_DN", 150},
    {"WPNAV_ACCEL", 200},  {"WPNAV_ACCEL_Z", 250}, {"VISO_TYPE", 1},        {"EK3_SRC1_POSXY", 6},
    {"EK3_SRC1_POSZ", 6},  {"EK3_SRC1_YAW", 6},    {"FS_EKF_ACTION", 1},    {"FS_THR_ENABLE", 3},
    {"FS_GCS_ENABLE", 0},  {"VISO_DELAY_MS", 10},  {"BATT_FS_LOW_ACT", 1},  {"BATT_FS_CRT_ACT", 0},
    {"ANGLE_MAX", 3000},   {"PSC_ANGLE_MAX", 0},   {"RTL_ALT", 0}};

ParameterValues values(Autopilot autopilot, const Named& named) {
  ParameterValues all{};
  const auto names = parameter_names(autopilot);
  for (std::size_t n = 0; n < names.size(); ++n)
    if (const auto found = named.find(names[n]); found != named.end()) all[n] = found->second;
  return all;
}

std::string forbids(Autopilot autopilot, Named named, const std::string& name, std::optional<double> value) {
  named.erase(name);
  if (value) named[name] = *value;
  return forbidding_parameter(autopilot, values(autopilot, named), vehicle());
}

TEST(Parameters, WhatIsSafeForbidsNothingAndHasNoAdvice) {
  for (const auto& [autopilot, named] :
       {std::pair(Autopilot::kPx4, kPx4Good), std::pair(Autopilot::kArduPilot, kArduPilotGood)}) {
    EXPECT_EQ(parameter_names(autopilot).size(), named.size());
    EXPECT_EQ(forbidding_parameter(autopilot, values(autopilot, named), vehicle()), "");
    for (const auto& finding : judge_parameters(autopilot, values(autopilot, named), vehicle()))
      EXPECT_TRUE(finding.good && finding.advice.empty()) << finding.name << ": " << finding.advice;
  }
}

// On each side of its limit; a default of the firmware is on the wrong one.
TEST(Parameters, EachThatAPromiseRestsOnForbidsBeyondItsLimit) {
  struct Case {
    Autopilot autopilot;
    const char* name;
    std::vector<double> bad, good;
  };
  const Case cases[] = {
      {Autopilot::kArduPilot, "GUID_TIMEOUT", {3, 0.31, 0, -1}, {0.3, 0.1}},
      {Autopilot::kArduPilot, "PSC_VELXY_P", {2, 3.59, 4.41}, {3.61, 4.39}},
      {Autopilot::kArduPilot, "PSC_POSXY_P", {1, 1.34, 1.66}, {1.36, 1.64}},
      {Autopilot::kArduPilot, "PSC_VELZ_P", {5, 7.19}, {7.21, 8.79}},
      {Autopilot::kArduPilot, "PSC_POSZ_P", {1, 1.66}, {1.36, 1.64}},
      {Autopilot::kArduPilot, "WPNAV_SPEED", {149}, {150, 1000}},
      {Autopilot::kArduPilot, "WPNAV_SPEED_UP", {149}, {150}},
      {Autopilot::kArduPilot, "WPNAV_SPEED_DN", {149}, {150}},
      {Autopilot::kArduPilot, "WPNAV_ACCEL", {199}, {200}},
      {Autopilot::kArduPilot, "WPNAV_ACCEL_Z", {100, 199}, {200}},
      // g tan 16.09° = √2 · 2 m/s²
      {Autopilot::kArduPilot, "ANGLE_MAX", {1000, 1608, 0}, {1610, 3000}},
      {Autopilot::kArduPilot, "PSC_ANGLE_MAX", {10, 16.0, -1}, {0, 16.2, 45}},
      {Autopilot::kPx4, "COM_OF_LOSS_T", {1, 0.51, 0}, {0.5, 0.2}},
      {Autopilot::kPx4, "COM_OBL_RC_ACT", {0, 1, 2, 3, 6, 7, -1, 4.5, 40}, {4, 5}},
      {Autopilot::kPx4, "MPC_XY_VEL_P_ACC", {1.8, 3.59}, {3.61}},
      {Autopilot::kPx4, "MPC_XY_P", {0.95, 1.66}, {1.64}},
      {Autopilot::kPx4, "MPC_Z_VEL_P_ACC", {4, 8.81}, {8.79}},
      {Autopilot::kPx4, "MPC_Z_P", {1, 1.34}, {1.36}},
      {Autopilot::kPx4, "MPC_XY_VEL_MAX", {1.49}, {1.5, 12}},
      {Autopilot::kPx4, "MPC_Z_VEL_MAX_UP", {1}, {1.5}},
      {Autopilot::kPx4, "MPC_Z_VEL_MAX_DN", {1}, {1.5}},
      {Autopilot::kPx4, "MPC_TILTMAX_AIR", {0, 12, 16.0}, {16.2, 45}},
  };
  for (const Case& c : cases) {
    const Named& rest = c.autopilot == Autopilot::kPx4 ? kPx4Good : kArduPilotGood;
    for (const double value : c.bad) {
      const std::string why = forbids(c.autopilot, rest, c.name, value);
      EXPECT_TRUE(why.starts_with(c.name)) << c.name << ' ' << value << ": " << why;
      EXPECT_NE(why.find(std::string("set ") + c.name), std::string::npos) << why;
    }
    for (const double value : c.good)
      EXPECT_EQ(forbids(c.autopilot, rest, c.name, value), "") << c.name << ' ' << value;
    EXPECT_EQ(forbids(c.autopilot, rest, c.name, {}), std::string("no value of ") + c.name + " from the autopilot yet");
  }
}

// As the link carries them.
TEST(Parameters, AFloatAtItsLimitIsGood) {
  Vehicle v = vehicle();
  v.limits.v_max = 1.3;
  Named named = kPx4Good;
  named["COM_OF_LOSS_T"] = static_cast<double>(0.3F);
  named["MPC_XY_VEL_MAX"] = named["MPC_Z_VEL_MAX_UP"] = named["MPC_Z_VEL_MAX_DN"] = static_cast<double>(1.3F);
  EXPECT_EQ(forbidding_parameter(Autopilot::kPx4, values(Autopilot::kPx4, named), v), "");
  EXPECT_EQ(forbids(Autopilot::kArduPilot, kArduPilotGood, "GUID_TIMEOUT", static_cast<double>(0.3F)), "");
  named["COM_OF_LOSS_T"] = static_cast<double>(0.39F);
  EXPECT_TRUE(judge_parameters(Autopilot::kPx4, values(Autopilot::kPx4, named), v).front().good);
}

// k_p is a product: two gains that are each nearly right may not be.
TEST(Parameters, ThePositionGainIsJudgedTogetherWithTheVelocityGain) {
  Named both = kPx4Good;
  both["MPC_XY_VEL_P_ACC"] = 3.7;
  EXPECT_TRUE(forbids(Autopilot::kPx4, both, "MPC_XY_P", 1.39).starts_with("MPC_XY_P is 1.39: set MPC_XY_P to 1.5"));
  EXPECT_EQ(forbids(Autopilot::kPx4, both, "MPC_XY_P", 1.6), "");
}

TEST(Parameters, WhatIsOnlyUnwiseIsToldAndForbidsNothing) {
  for (const auto& [autopilot, name, value] :
       // 0.39 s and the 0.11 s that PX4 adds are the half second after which nothing follows us (docs/faults.md row 36)
       {std::tuple(Autopilot::kPx4, "COM_OF_LOSS_T", 0.4),
        std::tuple(Autopilot::kPx4, "COM_OF_LOSS_T", 0.5),
        std::tuple(Autopilot::kPx4, "COM_RC_OVERRIDE", 1.0),
        std::tuple(Autopilot::kPx4, "NAV_DLL_ACT", 2.0),
        std::tuple(Autopilot::kPx4, "COM_LOW_BAT_ACT", 3.0),
        std::tuple(Autopilot::kPx4, "EKF2_EV_CTRL", 7.0),
        std::tuple(Autopilot::kPx4, "EKF2_HGT_REF", 0.0),
        std::tuple(Autopilot::kPx4, "NAV_RCL_ACT", 2.0),
        std::tuple(Autopilot::kPx4, "EKF2_EV_DELAY", 81.0),
        std::tuple(Autopilot::kArduPilot, "BATT_FS_LOW_ACT", 2.0),
        std::tuple(Autopilot::kArduPilot, "BATT_FS_CRT_ACT", 5.0),
        std::tuple(Autopilot::kArduPilot, "VISO_DELAY_MS", 100.0),
        std::tuple(Autopilot::kArduPilot, "VISO_TYPE", 0.0),
        std::tuple(Autopilot::kArduPilot, "EK3_SRC1_POSXY", 3.0),
        std::tuple(Autopilot::kArduPilot, "EK3_SRC1_POSZ", 1.0),
        std::tuple(Autopilot::kArduPilot, "EK3_SRC1_YAW", 1.0),
        std::tuple(Autopilot::kArduPilot, "FS_EKF_ACTION", 2.0),
        std::tuple(Autopilot::kArduPilot, "FS_THR_ENABLE", 1.0),
        std::tuple(Autopilot::kArduPilot, "FS_GCS_ENABLE", 1.0),
        std::tuple(Autopilot::kArduPilot, "RTL_ALT", 1500.0)}) {
    Named named = autopilot == Autopilot::kPx4 ? kPx4Good : kArduPilotGood;
    named[name] = value;
    const auto all = values(autopilot, named);
    EXPECT_EQ(forbidding_parameter(autopilot, all, vehicle()), "");
    for (const auto& finding : judge_parameters(autopilot, all, vehicle())) {
      EXPECT_EQ(finding.good, finding.name != name) << finding.name;
      EXPECT_EQ(finding.name == name, finding.advice.find(name) != std::string::npos) << finding.advice;
    }
  }
}

// docs/autopilots.md, "A line of 57,600 baud": with 57 ms both flew, with EKF2_EV_DELAY 0 PX4 left its sets.
TEST(Parameters, ALineThatIsTooSlowForTimesyncForbidsUntilTheAutopilotIsToldItsDelay) {
  const double line = untold_delay(serial_line(57'600, kSerialShare, false), false);
  for (const auto& [autopilot, good, name] : {std::tuple(Autopilot::kPx4, kPx4Good, "EKF2_EV_DELAY"),
                                              std::tuple(Autopilot::kArduPilot, kArduPilotGood, "VISO_DELAY_MS")}) {
    const auto forbids = [&](double value, double delay) {
      Named named = good;
      named[name] = value;
      return forbidding_parameter(autopilot, values(autopilot, named), vehicle(), delay);
    };
    for (const double value : {57.0, 46.0, 57.0 + 79}) EXPECT_EQ(forbids(value, line), "") << value;
    for (const double value : {0.0, 10.0, 44.0, 57.0 + 81})
      EXPECT_NE(forbids(value, line).find(std::string("set ") + name + " to 57 ms"), std::string::npos) << value;
    for (const double value : {0.0, 10.0, 500.0}) EXPECT_EQ(forbids(value, 0), "") << value;
    auto unknown = values(autopilot, good);
    unknown[static_cast<std::size_t>(std::ranges::find(parameter_names(autopilot), name) -
                                     parameter_names(autopilot).begin())]
        .reset();
    EXPECT_NE(forbidding_parameter(autopilot, unknown, vehicle(), line), "");
    EXPECT_EQ(forbidding_parameter(autopilot, unknown, vehicle(), line, false), "");
  }
}

TEST(Parameters, AControllerWithoutThemIsAskedForNone) {
  for (const auto autopilot : {Autopilot::kUnknown, Autopilot::kPlain}) {
    EXPECT_TRUE(parameter_names(autopilot).empty());
    EXPECT_EQ(forbidding_parameter(autopilot, {}, vehicle()), "");
  }
}

mavlink::ParamValue answer(std::string_view name, float value) {
  mavlink::ParamValue m{.param_value = value, .param_type = 9};
  std::ranges::copy(name, m.param_id.begin());
  return m;
}

TEST(Parameters, OnlyWhatWasAskedForIsKept) {
  Telemetry t;
  t.take(mavlink::Heartbeat{0, 2, 12, 0, 3}, kStart);
  ASSERT_TRUE(t.expect_parameter("COM_OF_LOSS_T"));
  for (int n = 0; n < 1000; ++n) t.take(answer("OTHER_" + std::to_string(n), 1), kStart);
  EXPECT_FALSE(t.parameter("COM_OF_LOSS_T"));
  EXPECT_FALSE(t.parameter("OTHER_1"));
  t.take(answer("COM_OF_LOSS_T", 0.3F), kStart);
  ASSERT_TRUE(t.parameter("COM_OF_LOSS_T"));
  EXPECT_FLOAT_EQ(static_cast<float>(t.parameter("COM_OF_LOSS_T")->value), 0.3F);
}

// What it was before is not what it is.
TEST(Parameters, OneWhoseNewestValueIsNoNumberIsNotKnown) {
  for (const float none : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    Telemetry t;
    t.take(mavlink::Heartbeat{0, 2, 3, 0, 3}, kStart);
    ASSERT_TRUE(t.expect_parameter("GUID_TIMEOUT") && t.expect_parameter("PSC_POSXY_P"));
    t.take(answer("GUID_TIMEOUT", 0.3F), kStart);
    t.take(answer("PSC_POSXY_P", none), kStart);
    EXPECT_TRUE(t.parameter("GUID_TIMEOUT")) << "another one";
    t.take(answer("GUID_TIMEOUT", none), kStart);
    EXPECT_FALSE(t.parameter("GUID_TIMEOUT"));
    EXPECT_EQ(t.broken, 2U);
  }
}

TEST(Parameters, AControllerThatWasSilentMayHaveRestartedWithOthersAndWithoutItsOrigin) {
  using namespace std::chrono_literals;
  Telemetry t;
  t.take(mavlink::Heartbeat{0, 2, 12, 0, 3}, kStart);
  ASSERT_TRUE(t.expect_parameter("COM_OF_LOSS_T"));
  t.take(answer("COM_OF_LOSS_T", 0.3F), kStart);
  t.take(mavlink::GpsGlobalOrigin{}, kStart);
  t.take(mavlink::Heartbeat{0, 2, 12, 0, 3}, kStart + 1400ms);
  EXPECT_TRUE(t.parameter("COM_OF_LOSS_T"));
  EXPECT_TRUE(t.has_origin);
  t.take(mavlink::Heartbeat{0, 2, 12, 0, 3}, kStart + 1400ms + kHeartbeatTimeout);
  EXPECT_FALSE(t.parameter("COM_OF_LOSS_T"));
  EXPECT_FALSE(t.has_origin);
}

}  // namespace
}  // namespace backwash::firmware_bridge::test
