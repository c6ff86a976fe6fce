// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/out/shown_diagnostics.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <map>

namespace backwash::daemon {
namespace {

struct Said {
  std::uint8_t level;
  std::string message;
};

/// Of a daemon in a state that nothing is wrong with, after `change`.
template <typename Change>
Said said(const std::string& state, Change&& change) {
  static const std::string vehicle = "quad", reason = "asked";
  dds::Status s{};
  s.vehicle = dds::c_string(vehicle);
  s.state = dds::c_string(state);
  s.reason = dds::c_string(reason);
  s.odometry_age = 0.01;
  s.odometry_lost_after = 0.08;
  change(s);
  const ShownDiagnostics shown(s, "fleet/one");
  const dds::DiagnosticStatus& d = shown.message().status._buffer[0];
  EXPECT_EQ(shown.message().status._length, 1u);
  EXPECT_STREQ(d.name, "backwashd: quad");
  EXPECT_STREQ(d.hardware_id, "fleet/one");
  return {d.level, d.message};
}
Said said(const std::string& state) {
  return said(state, [](auto&) {});
}

TEST(ShownDiagnostics, WarnOfWhatHoldsOrEndsAFlight) {
  for (const char* good : {"passive", "enabling", "lifting", "tracking"}) EXPECT_EQ(said(good).level, 0) << good;
  for (const char* held : {"hold", "land"}) EXPECT_EQ(said(held).level, 1) << held;
  EXPECT_EQ(said("tracking").message, "tracking: asked");
}

TEST(ShownDiagnostics, QuietInTheAirIsAnErrorAndOnTheGroundAWarning) {
  EXPECT_EQ(said("quiet", [](auto& s) { s.landed = false; }).level, 2);
  EXPECT_EQ(said("quiet", [](auto& s) { s.landed = true; }).level, 1);
}

TEST(ShownDiagnostics, NameWhatIsDoubtful) {
  for (const double age : {0.081, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    const Said late = said("passive", [&](auto& s) { s.odometry_age = age; });
    EXPECT_EQ(late.level, 1) << age;
    EXPECT_EQ(late.message, "passive: asked; no odometry") << age;
  }
  EXPECT_EQ(said("tracking", [](auto& s) { s.samples_outside = 3; }).message,
            "tracking: asked; 3 samples outside their sets");
  for (const std::string& in : {std::string("none"), std::string("yaw")}) {
    const Said said_of = said("passive", [&](auto& s) { s.mismatch = dds::c_string(in); });
    EXPECT_EQ(said_of.level, in == "none" ? 0 : 1);
    EXPECT_EQ(said_of.message, in == "none" ? "passive: asked" : "passive: asked; map and autopilot disagree: yaw");
  }
  static const std::string name = "MPC_XY_P", what = "set 2";
  dds::Advice advice{dds::c_string(name), dds::c_string(what)};
  const Said parameter = said("passive", [&](auto& s) { s.advice = {1, 1, &advice, false}; });
  EXPECT_EQ(parameter.level, 1);
  EXPECT_EQ(parameter.message, "passive: asked; parameter MPC_XY_P: set 2");
}

TEST(ShownDiagnostics, HoldTheValuesByName) {
  dds::Status s{};
  static const std::string state = "tracking", refused = "a map";
  s.state = dds::c_string(state);
  s.refused = dds::c_string(refused);
  s.samples_inside = 7;
  s.tick.p99 = 123.4F;
  const ShownDiagnostics shown(s, "one");
  const auto& values = shown.message().status._buffer[0].values;
  std::map<std::string, std::string> by_name;
  for (std::uint32_t n = 0; n < values._length; ++n) by_name[values._buffer[n].key] = values._buffer[n].value;
  EXPECT_EQ(by_name.size(), 10u);
  EXPECT_EQ(by_name["refused"], "a map");
  EXPECT_EQ(by_name["samples_inside"], "7");
  EXPECT_EQ(by_name["tick_us_p99"], "123");
}

}  // namespace
}  // namespace backwash::daemon
