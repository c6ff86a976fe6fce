// SPDX-License-Identifier: BSD-3-Clause
// Which parameters of the autopilot forbid that the daemon takes control (docs/faults.md row 51).
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>

#include "firmware_bridge/autopilots/profile.hpp"
#include "firmware_bridge/line_budget.hpp"
#include "firmware_bridge/message_requests.hpp"
#include "firmware_bridge/parameters.hpp"
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
const Named kPx4Good{
    {"COM_OF_LOSS_T", 0.3},    {"COM_OBL_RC_ACT", 4},   {"MPC_XY_VEL_P_ACC", 4}, {"MPC_XY_P", 1.5},
    {"MPC_Z_VEL_P_ACC", 8},    {"MPC_Z_P", 1.5},        {"MPC_XY_VEL_MAX", 1.5}, {"MPC_Z_VEL_MAX_UP", 3},
    {"MPC_Z_VEL_MAX_DN", 1.5}, {"MPC_TILTMAX_AIR", 45}, {"EKF2_EV_DELAY", 0},    {"NAV_RCL_ACT", 3},
    {"COM_RC_OVERRIDE", 3},    {"NAV_DLL_ACT", 0},      {"COM_LOW_BAT_ACT", 2},  {"EKF2_EV_CTRL", 15},
    {"EKF2_HGT_REF", 3},       {"EKF2_EV_QMIN", 50},    {"EKF2_DELAY_MAX", 200}, {"EKF2_GPS_CTRL", 0},
    {"EKF2_MAG_TYPE", 5},      {"COM_OBS_AVOID", 0}};
const Named kArduPilotGood{
    {"GUID_TIMEOUT", 0.3}, {"PSC_VELXY_P", 4},     {"PSC_POSXY_P", 1.5},    {"PSC_VELZ_P", 8},
    {"PSC_POSZ_P", 1.5},   {"WPNAV_SPEED", 150},   {"WPNAV_SPEED_UP", 250}, {"WPNAV_SPEED_DN", 150},
    {"WPNAV_ACCEL", 200},  {"WPNAV_ACCEL_Z", 250}, {"VISO_TYPE", 1},        {"EK3_SRC1_POSXY", 6},
    {"EK3_SRC1_POSZ", 6},  {"EK3_SRC1_YAW", 6},    {"FS_EKF_ACTION", 1},    {"FS_THR_ENABLE", 3},
    {"FS_GCS_ENABLE", 0},  {"VISO_DELAY_MS", 10},  {"BATT_FS_LOW_ACT", 1},  {"BATT_FS_CRT_ACT", 0},
    {"ANGLE_MAX", 3000},   {"PSC_ANGLE_MAX", 0},   {"RTL_ALT", 0},          {"VISO_QUAL_MIN", 0},
    {"EK3_SRC1_VELXY", 6}, {"EK3_SRC1_VELZ", 0},   {"EK3_SRC2_POSXY", 0},   {"EK3_SRC3_POSXY", 6},
    {"COMPASS_USE", 0},    {"GPS_TYPE", 0}};

/// The same vehicle under other names and units.
Named renamed(Named named) {
  const std::tuple<const char*, const char*, double> names[] = {
      {"PSC_VELXY_P", "PSC_NE_VEL_P", 1},    {"PSC_POSXY_P", "PSC_NE_POS_P", 1}, {"PSC_VELZ_P", "PSC_D_VEL_P", 1},
      {"PSC_POSZ_P", "PSC_D_POS_P", 1},      {"WPNAV_SPEED", "WP_SPD", 0.01},    {"WPNAV_SPEED_UP", "WP_SPD_UP", 0.01},
      {"WPNAV_SPEED_DN", "WP_SPD_DN", 0.01}, {"WPNAV_ACCEL", "WP_ACC", 0.01},    {"WPNAV_ACCEL_Z", "WP_ACC_Z", 0.01},
      {"ANGLE_MAX", "ATC_ANGLE_MAX", 0.01},  {"RTL_ALT", "RTL_ALT_M", 0.01},     {"GPS_TYPE", "GPS1_TYPE", 1}};
  for (const auto& [before, after, share] : names) {
    named[after] = share * named[before];
    named.erase(before);
  }
  return named;
}
const Named kArduPilot47Good = renamed(kArduPilotGood);

ParameterValues values(const AutopilotProfile& autopilot, const Named& named) {
  ParameterValues all{};
  for (std::size_t n = 0; n < autopilot.rules.size(); ++n)
    for (std::uint8_t k = 0; k < autopilot.rules[n].count(); ++k)
      if (const auto found = named.find(autopilot.rules[n].names[k].name); found != named.end()) {
        all[n].value = found->second;
        all[n].name = k;
      }
  return all;
}

ParameterAnswer& of(ParameterValues& values, const AutopilotProfile& autopilot, std::string_view name) {
  for (std::size_t n = 0; n < autopilot.rules.size(); ++n)
    for (const auto& each : autopilot.rules[n].names)
      if (each.name == name) return values[n];
  throw std::out_of_range(std::string(name));
}

std::string forbids(const AutopilotProfile& autopilot, Named named, const std::string& name,
                    std::optional<double> value) {
  named.erase(name);
  if (value) named[name] = *value;
  return forbidding_parameter(autopilot, values(autopilot, named), vehicle());
}

TEST(Parameters, WhatIsSafeForbidsNothingAndHasNoAdvice) {
  for (const auto& [autopilot, named] :
       {std::pair(&kPx4, kPx4Good), std::pair(&kArduPilot, kArduPilotGood), std::pair(&kArduPilot, kArduPilot47Good)}) {
    EXPECT_EQ(forbidding_parameter(*autopilot, values(*autopilot, named), vehicle()), "");
    const auto findings = judge_parameters(*autopilot, values(*autopilot, named), vehicle());
    EXPECT_EQ(findings.size(), named.size());
    for (const auto& finding : findings)
      EXPECT_TRUE(finding.good && finding.advice.empty()) << finding.name << ": " << finding.advice;
  }
}

// On each side of its limit; a default of the firmware is on the wrong one.
TEST(Parameters, EachThatAPromiseRestsOnForbidsBeyondItsLimit) {
  struct Case {
    const AutopilotProfile& autopilot;
    const char* name;
    std::vector<double> bad, good;
  };
  const Case cases[] = {
      {kArduPilot, "GUID_TIMEOUT", {3, 0.31, 0, -1}, {0.3, 0.1}},
      {kArduPilot, "PSC_VELXY_P", {2, 3.59, 4.41}, {3.61, 4.39}},
      {kArduPilot, "PSC_POSXY_P", {1, 1.34, 1.66}, {1.36, 1.64}},
      {kArduPilot, "PSC_VELZ_P", {5, 7.19}, {7.21, 8.79}},
      {kArduPilot, "PSC_POSZ_P", {1, 1.66}, {1.36, 1.64}},
      {kArduPilot, "WPNAV_SPEED", {149}, {150, 1000}},
      {kArduPilot, "WPNAV_SPEED_UP", {149}, {150}},
      {kArduPilot, "WPNAV_SPEED_DN", {149}, {150}},
      {kArduPilot, "WPNAV_ACCEL", {199}, {200}},
      {kArduPilot, "WPNAV_ACCEL_Z", {100, 199}, {200}},
      // g tan 16.09° = √2 · 2 m/s²
      {kArduPilot, "ANGLE_MAX", {1000, 1608, 0}, {1610, 3000}},
      {kArduPilot, "PSC_ANGLE_MAX", {10, 16.0, -1}, {0, 16.2, 45}},
      {kPx4, "COM_OF_LOSS_T", {1, 0.51, 0}, {0.5, 0.2}},
      {kPx4, "COM_OBL_RC_ACT", {0, 1, 2, 3, 6, 7, -1, 4.5, 40}, {4, 5}},
      {kPx4, "MPC_XY_VEL_P_ACC", {1.8, 3.59}, {3.61}},
      {kPx4, "MPC_XY_P", {0.95, 1.66}, {1.64}},
      {kPx4, "MPC_Z_VEL_P_ACC", {4, 8.81}, {8.79}},
      {kPx4, "MPC_Z_P", {1, 1.34}, {1.36}},
      {kPx4, "MPC_XY_VEL_MAX", {1.49}, {1.5, 12}},
      {kPx4, "MPC_Z_VEL_MAX_UP", {1}, {1.5}},
      {kPx4, "MPC_Z_VEL_MAX_DN", {1}, {1.5}},
      {kPx4, "MPC_TILTMAX_AIR", {0, 12, 16.0}, {16.2, 45}},
  };
  for (const Case& c : cases) {
    const Named& rest = &c.autopilot == &kPx4 ? kPx4Good : kArduPilotGood;
    for (const double value : c.bad) {
      const std::string why = forbids(c.autopilot, rest, c.name, value);
      EXPECT_TRUE(why.starts_with(c.name)) << c.name << ' ' << value << ": " << why;
      EXPECT_NE(why.find(std::string("set ") + c.name), std::string::npos) << why;
    }
    for (const double value : c.good)
      EXPECT_EQ(forbids(c.autopilot, rest, c.name, value), "") << c.name << ' ' << value;
    EXPECT_TRUE(forbids(c.autopilot, rest, c.name, {}).ends_with(" from the autopilot yet")) << c.name;
  }
}

// As the link carries them.
TEST(Parameters, AFloatAtItsLimitIsGood) {
  Vehicle v = vehicle();
  v.limits.v_max = 1.3;
  Named named = kPx4Good;
  named["COM_OF_LOSS_T"] = static_cast<double>(0.3F);
  named["MPC_XY_VEL_MAX"] = named["MPC_Z_VEL_MAX_UP"] = named["MPC_Z_VEL_MAX_DN"] = static_cast<double>(1.3F);
  EXPECT_EQ(forbidding_parameter(kPx4, values(kPx4, named), v), "");
  EXPECT_EQ(forbids(kArduPilot, kArduPilotGood, "GUID_TIMEOUT", static_cast<double>(0.3F)), "");
  named["COM_OF_LOSS_T"] = static_cast<double>(0.39F);
  EXPECT_TRUE(judge_parameters(kPx4, values(kPx4, named), v).front().good);
}

// k_p is a product: two gains that are each nearly right may not be.
TEST(Parameters, ThePositionGainIsJudgedTogetherWithTheVelocityGain) {
  Named both = kPx4Good;
  both["MPC_XY_VEL_P_ACC"] = 3.7;
  EXPECT_TRUE(forbids(kPx4, both, "MPC_XY_P", 1.39).ends_with("change the tune: set MPC_XY_P to 1.5"));
  EXPECT_EQ(forbids(kPx4, both, "MPC_XY_P", 1.6), "");
}

TEST(Parameters, WhatIsOnlyUnwiseIsToldAndForbidsNothing) {
  for (const auto& [autopilot, name, value] :
       // 0.39 s and the 0.11 s that PX4 adds are the half second after which nothing follows us (docs/faults.md row 36)
       {std::tuple(&kPx4, "COM_OF_LOSS_T", 0.4),         std::tuple(&kPx4, "COM_OF_LOSS_T", 0.5),
        std::tuple(&kPx4, "COM_RC_OVERRIDE", 1.0),       std::tuple(&kPx4, "NAV_DLL_ACT", 2.0),
        std::tuple(&kPx4, "COM_LOW_BAT_ACT", 3.0),       std::tuple(&kPx4, "EKF2_EV_CTRL", 7.0),
        std::tuple(&kPx4, "EKF2_HGT_REF", 0.0),          std::tuple(&kPx4, "NAV_RCL_ACT", 2.0),
        std::tuple(&kPx4, "EKF2_EV_DELAY", 81.0),        std::tuple(&kArduPilot, "BATT_FS_LOW_ACT", 2.0),
        std::tuple(&kArduPilot, "BATT_FS_CRT_ACT", 5.0), std::tuple(&kArduPilot, "VISO_DELAY_MS", 100.0),
        std::tuple(&kArduPilot, "VISO_TYPE", 0.0),       std::tuple(&kArduPilot, "EK3_SRC1_POSXY", 3.0),
        std::tuple(&kArduPilot, "EK3_SRC1_POSZ", 1.0),   std::tuple(&kArduPilot, "EK3_SRC1_YAW", 1.0),
        std::tuple(&kArduPilot, "FS_EKF_ACTION", 2.0),   std::tuple(&kArduPilot, "FS_THR_ENABLE", 1.0),
        std::tuple(&kArduPilot, "FS_GCS_ENABLE", 1.0),   std::tuple(&kArduPilot, "RTL_ALT", 1500.0)}) {
    Named named = autopilot == &kPx4 ? kPx4Good : kArduPilotGood;
    named[name] = value;
    const auto all = values(*autopilot, named);
    EXPECT_EQ(forbidding_parameter(*autopilot, all, vehicle()), "");
    for (const auto& finding : judge_parameters(*autopilot, all, vehicle())) {
      EXPECT_EQ(finding.good, finding.name != name) << finding.name;
      EXPECT_EQ(finding.name == name, finding.advice.find(name) != std::string::npos) << finding.advice;
    }
  }
}

// docs/autopilots.md, "A line of 57,600 baud": with 57 ms both flew, with EKF2_EV_DELAY 0 PX4 left its sets.
TEST(Parameters, ALineThatIsTooSlowForTimesyncForbidsUntilTheAutopilotIsToldItsDelay) {
  const double line = untold_delay(serial_line(57'600, kSerialShare, false), false);
  for (const auto& [autopilot, good, name] :
       {std::tuple(&kPx4, kPx4Good, "EKF2_EV_DELAY"), std::tuple(&kArduPilot, kArduPilotGood, "VISO_DELAY_MS")}) {
    const auto forbids = [&](double value, double delay) {
      Named named = good;
      named[name] = value;
      return forbidding_parameter(*autopilot, values(*autopilot, named), vehicle(), delay);
    };
    for (const double value : {57.0, 46.0, 57.0 + 79}) EXPECT_EQ(forbids(value, line), "") << value;
    for (const double value : {0.0, 10.0, 44.0, 57.0 + 81})
      EXPECT_NE(forbids(value, line).find(std::string("set ") + name + " to 57 ms"), std::string::npos) << value;
    for (const double value : {0.0, 10.0, 500.0}) EXPECT_EQ(forbids(value, 0), "") << value;
    auto unknown = values(*autopilot, good);
    of(unknown, *autopilot, name) = {};
    EXPECT_NE(forbidding_parameter(*autopilot, unknown, vehicle(), line), "");
    EXPECT_EQ(forbidding_parameter(*autopilot, unknown, vehicle(), line, false), "");
  }
}

TEST(Parameters, AControllerWithoutThemIsAskedForNone) {
  for (const auto* autopilot : {&kUnknownAutopilot, &kPlain}) {
    EXPECT_TRUE(autopilot->rules.empty());
    EXPECT_EQ(forbidding_parameter(*autopilot, {}, vehicle()), "");
  }
}

// Whatever a firmware calls it by a name of its own: it is found in the list of what it has and lacks, and named.
TEST(Parameters, OneThatTheFirmwareDoesNotHaveIsToldAsThatWithTheNamesTried) {
  for (const auto* autopilot : {&kPx4, &kArduPilot}) {
    const Named& good = autopilot == &kPx4 ? kPx4Good : kArduPilotGood;
    for (std::size_t n = 0; n < autopilot->rules.size(); ++n) {
      const ParameterRule& rule = autopilot->rules[n];
      auto all = values(*autopilot, good);
      all[n] = {};
      all[n].lacks = static_cast<std::uint8_t>((1u << rule.count()) - 1);
      const auto findings = judge_parameters(*autopilot, all, vehicle(), 0.05);
      const auto told = std::ranges::count_if(findings, [&](const auto& f) {
        const bool names = f.advice.find(rule.names[0].name) != std::string::npos &&
                           f.advice.find(rule.names[rule.count() - 1].name) != std::string::npos;
        return f.advice.starts_with("this firmware has no parameter") && names && !f.asking;
      });
      EXPECT_EQ(told, rule.need == Need::required || rule.need == Need::told) << rule.names[0].name;
      EXPECT_EQ(forbidding_parameter(*autopilot, all, vehicle(), 0.05).starts_with("this firmware has no parameter"),
                rule.need == Need::required)
          << rule.names[0].name;
    }
  }
}

TEST(Parameters, OneWithoutAnAnswerIsAskedForAWhileAndThenToldAsSilent) {
  auto all = values(kArduPilot, kArduPilotGood);
  ParameterAnswer& speed = of(all, kArduPilot, "WP_SPD");
  for (std::uint8_t asked = 0; asked < 8; ++asked) {
    speed = {};
    speed.asked = asked;
    const std::string why = forbidding_parameter(kArduPilot, all, vehicle());
    EXPECT_EQ(why.starts_with("no value of WP_SPD from the autopilot yet"), asked < 6) << why;
    EXPECT_EQ(why.starts_with("no answer to WPNAV_SPEED nor WP_SPD after "), asked >= 6) << why;
  }
}

// Profiles of autopilots against the parameters that each version's source declares (tests/bridge/parameters), and a
// further autopilot, which is one value and an entry in a list.

/// Unit of each parameter that the version declares.
std::map<std::string, std::string, std::less<>> declared(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  EXPECT_EQ(line, "name,unit,type,declared") << file;
  std::map<std::string, std::string, std::less<>> units;
  while (std::getline(in, line)) {
    std::istringstream fields(line);
    std::string name, unit;
    std::getline(std::getline(fields, name, ','), unit, ',');
    units[name] = unit;
  }
  return units;
}

/// How much of it is one of our unit.
double scale_of(const std::string& unit) {
  const std::map<std::string, double> scales{{"", 1},       {"s", 1},     {"ms", 1000},    {"m/s", 1},
                                             {"cm/s", 100}, {"m/s/s", 1}, {"cm/s/s", 100}, {"deg", 1},
                                             {"cdeg", 100}, {"%", 1},     {"m", 1},        {"cm", 100}};
  return scales.at(unit);
}

TEST(Profiles, NameEachParameterAsEveryVersionDeclaresItInItsUnit) {
  std::map<std::string_view, int> versions;
  for (const auto& file : std::filesystem::directory_iterator(BACKWASH_SOURCE_DIR "/tests/bridge/parameters")) {
    const auto* autopilot = file.path().stem().string().starts_with("px4") ? &kPx4 : &kArduPilot;
    ++versions[autopilot->name];
    const auto units = declared(file.path());
    std::size_t found = 0;
    for (const ParameterRule& rule : autopilot->rules) {
      std::size_t has = 0;
      for (std::size_t n = 0; n < rule.count(); ++n) {
        const auto unit = units.find(rule.names[n].name);
        if (unit == units.end()) continue;
        ++has;
        const bool number = rule.ask != Ask::one_of && rule.ask != Ask::bits;
        EXPECT_TRUE(!number || rule.names[n].scale == scale_of(unit->second)) << file << ' ' << unit->first;
      }
      found += has;
      EXPECT_LE(has, 1U) << file << ' ' << rule.names[0].name << ": which of two names counts?";
      const bool always = rule.need == Need::required || rule.need == Need::told;
      EXPECT_TRUE(!always || has == 1) << file << ' ' << rule.names[0].name;
    }
    EXPECT_EQ(found, units.size()) << file << " has a name that no rule asks for";
  }
  EXPECT_EQ(versions, (std::map<std::string_view, int>{{"px4", 3}, {"ardupilot", 3}}));
}

TEST(Profiles, AskForWhatForbidsFirstAndForAVelocityGainBeforeItsPositionGain) {
  for (const auto* autopilot : autopilots()) {
    EXPECT_TRUE(std::ranges::is_sorted(autopilot->rules, {}, [](const auto& r) { return r.need != Need::required; }));
    for (const auto& rule : autopilot->rules)
      for (const auto& name : rule.names) EXPECT_LE(name.name.size(), 16U) << name.name;
    Ask before = Ask::time_out;
    for (const auto& rule : autopilot->rules) {
      EXPECT_TRUE(rule.ask != Ask::k_p_horizontal || before == Ask::k_d_horizontal);
      EXPECT_TRUE(rule.ask != Ask::k_p_vertical || before == Ask::k_d_vertical);
      before = rule.ask;
    }
  }
}

mavlink::ParamValue answer(std::string_view name, float value) {
  mavlink::ParamValue m{.param_value = value, .param_type = 9};
  std::ranges::copy(name, m.param_id.begin());
  return m;
}

// By the older name first, then by the newer one; what one answer shows of the firmware is asked of the others first.
TEST(ParameterAnswers, AreAskedForByTheNamesOfTheFirmwareThatAnswers) {
  Telemetry t;
  t.take(mavlink::Heartbeat{0, 2, 3, 0, 3}, kStart);
  EXPECT_EQ(t.ask(1), "PSC_VELXY_P");
  EXPECT_EQ(t.ask(1), "PSC_NE_VEL_P");
  t.take(answer("PSC_NE_VEL_P", 4), kStart);
  EXPECT_EQ(t.parameters()[1].value, 4);
  EXPECT_EQ(t.ask(5), "WP_SPD");
  mavlink::ParamError none{.error = 1};
  std::ranges::copy(std::string_view("WP_SPD"), none.param_id.begin());
  t.take(none, kStart);
  for (int n = 0; n < 3; ++n) EXPECT_EQ(t.ask(5), "WPNAV_SPEED") << "it said that it has no WP_SPD";
}

TEST(ParameterAnswers, OnlyWhatTheProfileAsksForIsKept) {
  Telemetry t;
  t.take(mavlink::Heartbeat{0, 2, 12, 0, 3}, kStart);
  const auto& told = t.parameters()[0].value;  // of COM_OF_LOSS_T
  for (int n = 0; n < 1000; ++n) t.take(answer("OTHER_" + std::to_string(n), 1), kStart);
  for (const auto& each : t.parameters()) EXPECT_FALSE(each.value);
  t.take(answer("COM_OF_LOSS_T", 0.3F), kStart);
  ASSERT_TRUE(told);
  EXPECT_FLOAT_EQ(static_cast<float>(*told), 0.3F);
}

// What it was before is not what it is.
TEST(ParameterAnswers, OneWhoseNewestValueIsNoNumberIsNotKnown) {
  for (const float none : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    Telemetry t;
    t.take(mavlink::Heartbeat{0, 2, 3, 0, 3}, kStart);
    const auto& told = t.parameters()[0].value;  // of GUID_TIMEOUT
    t.take(answer("GUID_TIMEOUT", 0.3F), kStart);
    t.take(answer("PSC_POSXY_P", none), kStart);
    EXPECT_TRUE(told) << "another one";
    t.take(answer("GUID_TIMEOUT", none), kStart);
    EXPECT_FALSE(told);
    EXPECT_EQ(t.broken, 2U);
  }
}

TEST(ParameterAnswers, AControllerThatWasSilentMayHaveRestartedWithOthersAndWithoutItsOrigin) {
  using namespace std::chrono_literals;
  Telemetry t;
  t.take(mavlink::Heartbeat{0, 2, 12, 0, 3}, kStart);
  const auto& told = t.parameters()[0].value;
  t.take(answer("COM_OF_LOSS_T", 0.3F), kStart);
  t.take(mavlink::GpsGlobalOrigin{}, kStart);
  t.take(mavlink::Heartbeat{0, 2, 12, 0, 3}, kStart + 1400ms);
  EXPECT_TRUE(told);
  EXPECT_TRUE(t.has_origin);
  t.take(mavlink::Heartbeat{0, 2, 12, 0, 3}, kStart + 1400ms + kHeartbeatTimeout);
  EXPECT_FALSE(told);
  EXPECT_FALSE(t.has_origin);
}

// A further one, with a mode, a unit and a stream of its own: nothing else in the tree knows of it.
constexpr ParameterRule kOwnRules[] = {{{{"HOLD_AFTER_MS", 1000}}, Need::required, Ask::time_out, 0.4},
                                       {{{"FAST_MM_S", 1000}}, Need::told, Ask::v_max}};
constexpr Stream kOwnStreams[] = {{32, 40}};
constexpr AutopilotProfile kOwn{.name = "own",
                                .number = 99,
                                .rules = kOwnRules,
                                .streams = kOwnStreams,
                                .follows = true,
                                .follow = 3,
                                .follow_shift = 8,
                                .follow_mask = 0xF};

TEST(Profiles, AFurtherAutopilotIsOneValueAndALine) {
  const AutopilotProfile* const known[] = {&kPx4, &kOwn};
  Telemetry t(known);
  t.take(mavlink::Heartbeat{3 << 8, 2, 99, 1, 3}, kStart);
  const auto status = t.status.at(kStart);
  ASSERT_TRUE(status);
  EXPECT_EQ(status->value.autopilot->name, "own");
  EXPECT_TRUE(status->value.follows_setpoints);
  t.take(mavlink::Heartbeat{2 << 8, 2, 99, 1, 3}, kStart);
  EXPECT_FALSE(t.status.at(kStart)->value.follows_setpoints);

  mavlink::ParamValue m{.param_value = 900, .param_type = 9};
  std::ranges::copy(t.ask(0), m.param_id.begin());
  t.take(m, kStart);
  Vehicle vehicle;
  EXPECT_EQ(forbidding_parameter(t.autopilot(), t.parameters(), vehicle).substr(0, 48),
            "HOLD_AFTER_MS is 900: set HOLD_AFTER_MS above 0 ");
  m.param_value = 300;
  t.take(m, kStart);
  EXPECT_EQ(forbidding_parameter(t.autopilot(), t.parameters(), vehicle), "");

  MessageRequests requests;
  const auto asked = requests.next(t.autopilot(), {}, kStart);
  ASSERT_TRUE(asked);
  EXPECT_EQ(asked->rate_hz, 40);
  EXPECT_EQ(&profile_of(99), &kUnknownAutopilot) << "it is in no list but this one";
}

}  // namespace
}  // namespace backwash::firmware_bridge::test
