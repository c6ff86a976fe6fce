// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <string_view>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "services/backwashd/out/shown_battery.hpp"
#include "services/backwashd/out/shown_diagnostics.hpp"
#include "services/backwashd/out/shown_field.hpp"
#include "services/backwashd/out/shown_segment.hpp"

namespace backwash::daemon {
namespace {

TEST(ShownSegment, IsInTheFrameThatTheConfigurationCallsTheMaps) {
  track::AcceptedSegment segment{};
  const Vec3 still = Vec3::Zero();
  segment.commands = {{{1, 2, 3}, still, still, 0.4}, {{4, 5, 6}, still, still, -0.4}};
  segment.tube.resize(1);
  segment.tube[0].center.p_W = {7, 8, 9};
  segment.tube[0].half_widths_interval.fill(0.25);
  const ShownSegment shown(segment, "site");
  EXPECT_EQ(shown.tube().header.frame_id, std::string_view("site"));
  EXPECT_EQ(shown.trajectory().header.frame_id, std::string_view("site"));
  ASSERT_EQ(shown.trajectory().poses._length, 2u);
  const dds::PoseStamped& second = shown.trajectory().poses._buffer[1];
  EXPECT_EQ(second.header.frame_id, std::string_view("site"));
  EXPECT_EQ(second.pose.position.y, 5);
  EXPECT_DOUBLE_EQ(2 * std::atan2(second.pose.orientation.z, second.pose.orientation.w), -0.4);
  ASSERT_EQ(shown.tube().steps._length, 1u);
  EXPECT_EQ(shown.tube().steps._buffer[0].center.z, 9);
  EXPECT_EQ(shown.tube().steps._buffer[0].half_widths[4], 0.25);
}

// 250 steps of one set each along x: every set lies in one of the boxes, and none of them is a box of all.
TEST(ShownSegment, EverySetLiesInOneOfAHundredBoxes) {
  track::AcceptedSegment segment{};
  segment.commands = {{{0, 0, 1}, Vec3::Zero(), Vec3::Zero(), 0}, {{2.5, 0, 1}, Vec3::Zero(), Vec3::Zero(), 0}};
  segment.tube.resize(250);
  for (std::size_t n = 0; n < segment.tube.size(); ++n) {
    segment.tube[n].center.p_W = {0.01 * static_cast<double>(n), 0, 1};
    segment.tube[n].half_widths_interval = {0.1, 0.05 + 0.001 * static_cast<double>(n % 7), 0.2, 0.1, 0.1};
  }
  const ShownSegment shown(segment, "map");
  const auto& markers = shown.markers().markers;
  ASSERT_EQ(markers._length, 2u + 84u) << "what was there is deleted; a line; three steps a box";
  EXPECT_EQ(markers._buffer[0].action, 3);
  EXPECT_EQ(markers._buffer[1].type, 4);
  EXPECT_EQ(markers._buffer[1].points._length, 2u);
  for (const auto& step : segment.tube) {
    bool inside = false;
    for (std::uint32_t n = 2; n < markers._length; ++n) {
      const auto& m = markers._buffer[n];
      EXPECT_LT(m.scale.x, 0.3);
      const Vec3 off(step.center.p_W.x() - m.pose.position.x, step.center.p_W.y() - m.pose.position.y,
                     step.center.p_W.z() - m.pose.position.z);
      const Vec3 room = Vec3(m.scale.x, m.scale.y, m.scale.z) / 2 - off.cwiseAbs();
      inside =
          inside || (room.x() > 0.1 - 1e-9 && room.y() > step.half_widths_interval[1] - 1e-9 && room.z() > 0.2 - 1e-9);
    }
    EXPECT_TRUE(inside) << step.center.p_W.x();
  }
}

TEST(ShownSegment, MarkersOfNothingDeleteWhatWasThere) {
  const ShownSegment shown(track::AcceptedSegment{}, "map");
  ASSERT_EQ(shown.markers().markers._length, 2u);
  EXPECT_EQ(shown.markers().markers._buffer[0].action, 3);
}

const plan::World& apartment() {
  static const auto world =
      plan::build_world(map::builtin_scene("apartment", 0.2).value(), config::load_model("builtin:quad-5in").value(),
                        config::load_vehicle("builtin:quad-5in").value());
  return *world;
}

TEST(ShownField, HasTheBoundsOfTheVehiclesLayerAndNoOthers) {
  const Vec3 vehicle_W(3, 4.2, 1.25);
  const ShownField shown(apartment(), vehicle_W, "map");
  const auto& cloud = shown.cloud();
  EXPECT_STREQ(cloud.header.frame_id, "map");
  ASSERT_EQ(cloud.point_step, 20u);
  ASSERT_EQ(cloud.data._length, cloud.width * 20);
  const auto& grid = apartment().grid;
  const int layer = grid.index(vehicle_W).z();
  std::size_t expected = 0, found = 0;
  for (std::size_t n = 0; n < grid.cell_count(); ++n)
    expected += grid.voxel(n).z() == layer && apartment().bounds.at(grid.voxel(n)).w[kZ] > 0;
  for (std::uint32_t n = 0; n < cloud.width; ++n) {
    float point[5];
    std::memcpy(point, cloud.data._buffer + n * 20, 20);
    const Index3 v = grid.index(Vec3(point[0], point[1], point[2]));
    ASSERT_EQ(v.z(), layer);
    const auto w = apartment().bounds.at(v).w;
    EXPECT_FLOAT_EQ(point[3], static_cast<float>(std::max({w[kX], w[kY], w[kXyPlus], w[kXyMinus]})));
    EXPECT_FLOAT_EQ(point[4], static_cast<float>(w[kZ]));
    found += point[4] > 0;
  }
  EXPECT_GT(expected, 500u);
  EXPECT_EQ(found, expected);  // the apartment is no wider than what is shown
}

TEST(ShownField, EndsAtItsDistanceAndIsEmptyBesideTheMap) {
  const auto& grid = apartment().grid;
  const Vec3 beside = grid.origin() - Vec3(ShownField::kAround, 0, 0) + Vec3(2, 3, 1.2);
  const ShownField part(apartment(), beside, "map");
  ASSERT_GT(part.cloud().width, 10u);
  for (std::uint32_t n = 0; n < part.cloud().width; ++n) {
    float x;
    std::memcpy(&x, part.cloud().data._buffer + n * 20, 4);
    EXPECT_LE(x, beside.x() + ShownField::kAround + grid.resolution());
  }
  for (const Vec3& outside : {Vec3(3, 4, -50), Vec3(3, 4, 50), Vec3(500, 4, 1), Vec3(-500, -500, 1)})
    EXPECT_EQ(ShownField(apartment(), outside, "map").cloud().width, 0u);
}

TEST(FieldShows, AtAnotherWorldLayerOrPlaceOnceASecond) {
  constexpr std::int64_t s = 1'000'000'000;
  const auto other = std::make_unique<plan::World>(apartment());
  FieldShows shows;
  std::int64_t now = 5 * s;
  const Vec3 p(3, 4.2, 1.25);
  EXPECT_TRUE(shows.due(apartment(), p, now));
  EXPECT_FALSE(shows.due(*other, p, now + s / 2));  // too soon
  EXPECT_FALSE(shows.due(apartment(), p + Vec3(0.9, 0, 0), now += 2 * s));
  EXPECT_TRUE(shows.due(apartment(), p + Vec3(1.1, 0, 0), now += 2 * s));
  EXPECT_TRUE(shows.due(apartment(), p + Vec3(1.1, 0, 0.2), now += 2 * s));
  EXPECT_FALSE(shows.due(apartment(), p + Vec3(1.1, 0, 0.2), now += 2 * s));
  EXPECT_TRUE(shows.due(*other, p + Vec3(1.1, 0, 0.2), now += 2 * s));
}

using firmware_bridge::Battery;
using firmware_bridge::Latest;
using std::chrono::milliseconds;

const firmware_bridge::Time kStart{std::chrono::hours(1)};
constexpr std::int64_t kWall_ns = 1'900'000'000'250'000'000;

Latest<Battery> told(Battery battery, milliseconds at = {}) { return {{battery, kStart + at}}; }

TEST(ShownBattery, SaysWhatTheAutopilotSaysInRos2sUnitsAndSigns) {
  ShownBattery shown;
  const auto* m = shown.next(told({15.6, 0.87, 12.5}), kStart + milliseconds(500), kWall_ns);
  ASSERT_TRUE(m);
  EXPECT_FLOAT_EQ(m->voltage, 15.6F);
  EXPECT_FLOAT_EQ(m->percentage, 0.87F);
  EXPECT_FLOAT_EQ(m->current, -12.5F) << "below 0 while it is discharged";
  EXPECT_TRUE(m->present);
  EXPECT_EQ(dds::nanoseconds(m->header.stamp), kWall_ns - 500'000'000) << "when it was said";
  EXPECT_LT(m->header.stamp.nanosec, 1'000'000'000U);
}

TEST(ShownBattery, SaysNanOrUnknownForWhatTheAutopilotDoesNotSay) {
  ShownBattery shown;
  const auto* m = shown.next(told({}), kStart, kWall_ns);
  ASSERT_TRUE(m);
  for (const float value :
       {m->voltage, m->temperature, m->current, m->charge, m->capacity, m->design_capacity, m->percentage})
    EXPECT_TRUE(std::isnan(value));
  for (const int kind : {m->power_supply_status, m->power_supply_health, m->power_supply_technology})
    EXPECT_EQ(kind, 0);
  EXPECT_EQ(m->cell_voltage._length + m->cell_temperature._length, 0U);
  for (const char* text : {m->header.frame_id, m->location, m->serial_number}) EXPECT_STREQ(text, "");
}

TEST(ShownBattery, IsSentOnceForEachNewsAndOnceASecondAtMost) {
  ShownBattery shown;
  EXPECT_FALSE(shown.next({}, kStart, kWall_ns)) << "nothing was said yet";
  int sent = 0;
  for (milliseconds t{0}; t < milliseconds(10'000); t += milliseconds(100))  // it says something five times a second
    sent += shown.next(told({15, 0.5, {}}, milliseconds(t.count() / 200 * 200)), kStart + t, kWall_ns) != nullptr;
  EXPECT_EQ(sent, 10);
  for (milliseconds t{10'000}; t < milliseconds(20'000); t += milliseconds(100))  // and then nothing new any more
    sent += shown.next(told({15, 0.5, {}}, milliseconds(9'900)), kStart + t, kWall_ns) != nullptr;
  EXPECT_EQ(sent, 11);
}

TEST(ShownBattery, SaysOnceThatNothingIsKnownAnyMore) {
  ShownBattery shown;
  ASSERT_TRUE(shown.next(told({15, 0.5, {}}), kStart, kWall_ns));
  const auto* m = shown.next({}, kStart + milliseconds(5'100), kWall_ns);
  ASSERT_TRUE(m);
  EXPECT_TRUE(std::isnan(m->percentage) && std::isnan(m->voltage));
  EXPECT_FALSE(shown.next({}, kStart + milliseconds(10'000), kWall_ns));
}

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
