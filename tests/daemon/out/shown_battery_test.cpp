// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/out/shown_battery.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

namespace backwash::daemon {
namespace {

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

}  // namespace
}  // namespace backwash::daemon
