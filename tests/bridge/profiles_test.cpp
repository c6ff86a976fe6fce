// SPDX-License-Identifier: BSD-3-Clause
// Profiles of autopilots against the parameters that each version's source declares (tests/bridge/parameters), and a
// further autopilot, which is one value and an entry in a list.
#include "firmware_bridge/autopilots/profile.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>

#include "firmware_bridge/message_requests.hpp"
#include "tests/bridge/emulated_controller.hpp"

namespace backwash::firmware_bridge::test {
namespace {

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
