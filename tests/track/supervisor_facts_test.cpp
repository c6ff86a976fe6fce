// SPDX-License-Identifier: BSD-3-Clause
// Every fact by itself: which mode and reason it leads to, from flight, from enabling and as a refusal to enable.
#include <gtest/gtest.h>

#include <functional>

#include "core/track/supervisor.hpp"
#include "tests/track/flown/healthy.hpp"

namespace backwash::track {
namespace {

using Change = std::function<void(SupervisorInput&)>;

/// Enabled on the ground, disarmed and not yet followed.
Supervisor enabling() {
  Supervisor s;
  SupervisorInput in = healthy();
  in.armed = in.offboard = false;
  in.request = Request::enable;
  EXPECT_EQ(s.step(in).mode, Mode::enabling);
  return s;
}

Supervisor flying_after_takeoff() {
  Supervisor s = enabling();
  EXPECT_EQ(s.step(healthy()).mode, Mode::tracking);
  s.step(healthy());
  return s;
}

SupervisorOutput after(Supervisor s, const Change& change, SupervisorInput in = healthy()) {
  change(in);
  return s.step(in);
}

TEST(SupervisorFacts, EachEndsTrackingInItsOwnWay) {
  const struct {
    Mode mode;
    Reason reason;
    Change change;
  } rows[] = {
      {Mode::quiet, Reason::port_lost, [](auto& in) { in.port_open = false; }},
      {Mode::quiet, Reason::transmit_full, [](auto& in) { in.transmit_failed = true; }},
      {Mode::quiet, Reason::autopilot_silent, [](auto& in) { in.heartbeat_age = 1.51; }},
      {Mode::quiet, Reason::clock_stopped, [](auto& in) { in.missed_periods = 25; }},
      {Mode::passive, Reason::offboard_left, [](auto& in) { in.offboard = false; }},
      {Mode::passive, Reason::disarmed, [](auto& in) { in.armed = false; }},
      {Mode::land, Reason::land_requested, [](auto& in) { in.request = Request::land; }},
      {Mode::hold, Reason::odometry_jump, [](auto& in) { in.odometry_jump = true; }},
      {Mode::hold, Reason::odometry_inconsistent, [](auto& in) { in.odometry_inconsistent = true; }},
      {Mode::hold, Reason::pose_silent, [](auto& in) { in.pose_age = 0.31; }},
      {Mode::hold, Reason::closure_refused, [](auto& in) { in.closure_refused = true; }},
      {Mode::hold, Reason::odometry_frozen, [](auto& in) { in.odometry_frozen = true; }},
      {Mode::hold, Reason::odometry_disorder, [](auto& in) { in.odometry_disorder = true; }},
      {Mode::hold, Reason::odometry_lost, [](auto& in) { in.odometry_age = 0.081; }},
      {Mode::hold, Reason::line_slow, [](auto& in) { in.line_slow = true; }},
      {Mode::hold, Reason::frames_disagree, [](auto& in) { in.frames_agree = false; }},
      {Mode::hold, Reason::frames_apart, [](auto& in) { in.frames_apart = true; }},
      {Mode::land, Reason::battery_low, [](auto& in) { in.battery_low = true; }},
      {Mode::hold, Reason::autopilot_reset, [](auto& in) { in.autopilot_reset = true; }},
      {Mode::hold, Reason::stop_requested, [](auto& in) { in.request = Request::stop; }},
      {Mode::hold, Reason::stop_requested, [](auto& in) { in.request = Request::disable; }},
      {Mode::hold, Reason::obstacle_ahead, [](auto& in) { in.obstacle_ahead = true; }},
      {Mode::hold, Reason::air_rougher, [](auto& in) { in.air_rougher = true; }},
      {Mode::hold, Reason::outside_map, [](auto& in) { in.outside_map = true; }},
      {Mode::hold, Reason::map_late, [](auto& in) { in.map_late = true; }},
  };
  EXPECT_EQ(after(flying_after_takeoff(), [](auto&) {}).mode, Mode::tracking);
  for (const auto& row : rows) {
    const auto out = after(flying_after_takeoff(), row.change);
    EXPECT_EQ(out.mode, row.mode) << to_string(row.reason);
    EXPECT_EQ(out.reason, row.reason) << to_string(row.reason);
  }
}

// A set-point that goes on by a pose that is not trusted would be flown on it.
TEST(SupervisorFacts, WhatSpeaksAgainstThePoseFreezesTheSetPointAndNothingElseDoes) {
  const struct {
    bool freezes;
    Change change;
  } rows[] = {
      {true, [](auto& in) { in.odometry_jump = true; }},    {true, [](auto& in) { in.odometry_inconsistent = true; }},
      {true, [](auto& in) { in.odometry_frozen = true; }},  {true, [](auto& in) { in.odometry_disorder = true; }},
      {true, [](auto& in) { in.odometry_age = 0.081; }},    {true, [](auto& in) { in.frames_agree = false; }},
      {false, [](auto& in) { in.frames_apart = true; }},    {false, [](auto& in) { in.request = Request::stop; }},
      {false, [](auto& in) { in.obstacle_ahead = true; }},  {false, [](auto& in) { in.air_rougher = true; }},
      {false, [](auto& in) { in.autopilot_reset = true; }},
  };
  for (const auto& row : rows) {
    const auto out = after(flying_after_takeoff(), row.change);
    EXPECT_EQ(out.mode, Mode::hold);
    EXPECT_EQ(out.freeze, row.freezes) << to_string(out.reason);
  }
}

TEST(SupervisorFacts, AHoldLandsByOrderAndOnALowBattery) {
  const std::pair<Reason, Change> rows[] = {{Reason::land_requested, [](auto& in) { in.request = Request::land; }},
                                            {Reason::battery_low, [](auto& in) { in.battery_low = true; }}};
  for (const auto& [reason, change] : rows) {
    Supervisor s = flying_after_takeoff();
    SupervisorInput stop = healthy();
    stop.request = Request::stop;
    EXPECT_EQ(s.step(stop).mode, Mode::hold);
    const auto out = after(s, change);
    EXPECT_EQ(out.mode, Mode::land) << to_string(reason);
    EXPECT_EQ(out.reason, reason);
  }
}

/// A take-off was accepted a tick ago, and the motors run.
Supervisor lifting() {
  Supervisor s = flying_after_takeoff();
  SupervisorInput in = healthy();
  in.armed = false;
  EXPECT_EQ(s.step(in).mode, Mode::passive) << "nobody flies yet";
  in.request = Request::enable;
  s.step(in);
  in.request = Request::none;
  EXPECT_EQ(s.step(in).mode, Mode::tracking);
  in.new_segment = in.takeoff = in.arming = true;
  EXPECT_EQ(s.step(in).mode, Mode::lifting);
  EXPECT_EQ(s.step(healthy()).mode, Mode::lifting);
  return s;
}

// Below the lowest safe hover height no hold is verified: it lands, or belongs to somebody else, or is in the air.
TEST(SupervisorFacts, EachEndsALiftOffInItsOwnWay) {
  const struct {
    Mode mode;
    Reason reason;
    Change change;
  } rows[] = {
      {Mode::quiet, Reason::port_lost, [](auto& in) { in.port_open = false; }},
      {Mode::quiet, Reason::autopilot_silent, [](auto& in) { in.heartbeat_age = 1.51; }},
      {Mode::passive, Reason::offboard_left, [](auto& in) { in.offboard = false; }},
      {Mode::passive, Reason::disarmed, [](auto& in) { in.armed = false; }},
      {Mode::land, Reason::land_requested, [](auto& in) { in.request = Request::land; }},
      {Mode::land, Reason::stop_requested, [](auto& in) { in.request = Request::stop; }},
      {Mode::land, Reason::stop_requested, [](auto& in) { in.request = Request::disable; }},
      {Mode::land, Reason::pose_silent, [](auto& in) { in.pose_age = 0.31; }},
      {Mode::land, Reason::odometry_jump, [](auto& in) { in.odometry_jump = true; }},
      {Mode::land, Reason::odometry_inconsistent, [](auto& in) { in.odometry_inconsistent = true; }},
      {Mode::land, Reason::odometry_frozen, [](auto& in) { in.odometry_frozen = true; }},
      {Mode::land, Reason::odometry_disorder, [](auto& in) { in.odometry_disorder = true; }},
      {Mode::land, Reason::odometry_lost, [](auto& in) { in.odometry_age = 0.081; }},
      {Mode::land, Reason::frames_disagree, [](auto& in) { in.frames_agree = false; }},
      {Mode::land, Reason::autopilot_reset, [](auto& in) { in.autopilot_reset = true; }},
      {Mode::land, Reason::closure_refused, [](auto& in) { in.closure_refused = true; }},
      {Mode::land, Reason::battery_low, [](auto& in) { in.battery_low = true; }},
      {Mode::land, Reason::obstacle_ahead, [](auto& in) { in.obstacle_ahead = true; }},
      {Mode::land, Reason::air_rougher, [](auto& in) { in.air_rougher = true; }},
      {Mode::land, Reason::outside_map, [](auto& in) { in.outside_map = true; }},
      {Mode::land, Reason::map_late, [](auto& in) { in.map_late = true; }},
      {Mode::tracking, Reason::lifted_off, [](auto& in) { in.lifted = true; }},
  };
  EXPECT_EQ(after(lifting(), [](auto&) {}).mode, Mode::lifting);
  for (const auto& row : rows) {
    const auto out = after(lifting(), row.change);
    EXPECT_EQ(out.mode, row.mode) << to_string(row.reason);
    EXPECT_EQ(out.reason, row.reason) << to_string(row.reason);
  }
}

TEST(SupervisorFacts, EachRefusesToEnableInItsOwnWay) {
  const struct {
    Reason reason;
    Change change;
  } rows[] = {
      {Reason::port_lost, [](auto& in) { in.port_open = false; }},
      {Reason::autopilot_silent, [](auto& in) { in.heartbeat_age = 1.51; }},
      {Reason::pose_silent, [](auto& in) { in.pose_age = 0.31; }},
      {Reason::odometry_lost, [](auto& in) { in.odometry_age = 0.081; }},
      {Reason::map_missing, [](auto& in) { in.map_missing = true; }},
      {Reason::outside_map, [](auto& in) { in.outside_map = true; }},
      {Reason::frame_mismatch_x, [](auto& in) { in.mismatch = Mismatch::x; }},
      {Reason::frame_mismatch_y, [](auto& in) { in.mismatch = Mismatch::y; }},
      {Reason::frame_mismatch_z, [](auto& in) { in.mismatch = Mismatch::z; }},
      {Reason::frame_mismatch_yaw, [](auto& in) { in.mismatch = Mismatch::yaw; }},
      {Reason::frame_mismatch_roll, [](auto& in) { in.mismatch = Mismatch::roll; }},
      {Reason::frame_mismatch_pitch, [](auto& in) { in.mismatch = Mismatch::pitch; }},
  };
  for (const auto& row : rows) {
    SupervisorInput in = healthy();
    in.request = Request::enable;
    const auto out = after(Supervisor(), row.change, in);
    EXPECT_EQ(out.mode, Mode::passive) << to_string(row.reason);
    EXPECT_EQ(out.reason, row.reason) << to_string(row.reason);
  }
}

TEST(SupervisorFacts, WhatComesUpWhileEnablingEndsIt) {
  const struct {
    Reason reason;
    Change change;
  } rows[] = {
      {Reason::operator_request, [](auto& in) { in.request = Request::disable; }},
      {Reason::operator_request, [](auto& in) { in.request = Request::stop; }},
      {Reason::operator_request,
       [](auto& in) {
         in.request = Request::stop;
         in.armed = true;
       }},
      {Reason::odometry_lost, [](auto& in) { in.odometry_age = 0.081; }},
      {Reason::odometry_jump, [](auto& in) { in.odometry_jump = true; }},
      {Reason::odometry_inconsistent, [](auto& in) { in.odometry_inconsistent = true; }},
      {Reason::pose_silent, [](auto& in) { in.pose_age = 0.31; }},
      {Reason::closure_refused, [](auto& in) { in.closure_refused = true; }},
      {Reason::frame_mismatch_x, [](auto& in) { in.mismatch = Mismatch::x; }},
      {Reason::frame_mismatch_yaw, [](auto& in) { in.mismatch = Mismatch::yaw; }},
      {Reason::frame_mismatch_pitch, [](auto& in) { in.mismatch = Mismatch::pitch; }},
  };
  for (const auto& row : rows) {
    SupervisorInput in = healthy();
    in.armed = in.offboard = false;
    const auto out = after(enabling(), row.change, in);
    EXPECT_EQ(out.mode, Mode::passive) << to_string(row.reason);
    EXPECT_EQ(out.reason, row.reason) << to_string(row.reason);
  }
  SupervisorInput flies = healthy();  // after a restart in the air, before the frames agree
  flies.frames_aligned = false;
  for (const Request asked : {Request::land, Request::stop, Request::disable}) {
    flies.request = asked;
    EXPECT_EQ(enabling().step(flies).mode, Mode::land);
  }
}

TEST(SupervisorFacts, FramesThatAreNotAlignedSendNothingAndAreNotFollowed) {
  Supervisor s = enabling();
  SupervisorInput in = healthy();
  in.armed = in.offboard = false;
  int asked = 0;
  for (int tick = 0; tick < 120; ++tick) {  // 2.4 s: the stream has lasted long enough
    const auto out = s.step(in);
    EXPECT_TRUE(out.send_setpoint);
    EXPECT_FALSE(tick < 50 && out.request_offboard) << "before a second of set-points";
    asked += out.request_offboard;
  }
  EXPECT_GE(asked, 2);
  in.frames_aligned = false;
  for (int tick = 0; tick < 100; ++tick) {
    const auto out = s.step(in);
    EXPECT_EQ(out.mode, Mode::enabling);
    EXPECT_FALSE(out.send_setpoint || out.request_offboard) << tick;
  }
  in.offboard = true;  // of its own accord, say by the pilot's switch
  EXPECT_EQ(s.step(in).mode, Mode::enabling);
  in.frames_aligned = true;
  EXPECT_EQ(s.step(in).mode, Mode::tracking);
}

TEST(SupervisorFacts, ADisableLetsGoOnlyOfAVehicleThatStands) {
  SupervisorInput in = healthy();
  in.request = Request::disable;
  EXPECT_EQ(flying_after_takeoff().step(in).mode, Mode::hold) << "armed: it may fly";
  in.armed = false;
  in.arming = true;
  Supervisor s = enabling();
  SupervisorInput disarmed = healthy();
  disarmed.armed = false;
  EXPECT_EQ(s.step(disarmed).mode, Mode::tracking);
  EXPECT_EQ(Supervisor(s).step(in).mode, Mode::hold) << "it was just asked to arm";
  in.arming = false;
  EXPECT_EQ(s.step(in).mode, Mode::passive);
}

TEST(SupervisorFacts, LandIsAskedForTwiceAndNeverOfAPilot) {
  Supervisor s = flying_after_takeoff();
  SupervisorInput in = healthy();
  in.request = Request::land;
  int asked = s.step(in).request_land;
  in.request = Request::none;
  for (int tick = 0; tick < 40; ++tick) asked += s.step(in).request_land;
  EXPECT_EQ(asked, 2);
  Supervisor left = flying_after_takeoff();
  in.request = Request::land;
  EXPECT_TRUE(left.step(in).request_land);
  in.request = Request::none;
  in.offboard = false;
  for (int tick = 0; tick < 40; ++tick) EXPECT_FALSE(left.step(in).request_land);
}

// Row 24: an operator who enables again on a low battery is not landed again.
TEST(SupervisorFacts, ALowBatteryLandsOnce) {
  Supervisor s = flying_after_takeoff();
  SupervisorInput in = healthy();
  in.battery_low = true;
  EXPECT_EQ(s.step(in).mode, Mode::land);
  in.armed = in.offboard = false;
  EXPECT_EQ(s.step(in).mode, Mode::passive);
  in.request = Request::enable;
  EXPECT_EQ(s.step(in).mode, Mode::enabling);
  in.request = Request::none;
  in.offboard = in.armed = true;
  for (int tick = 0; tick < 20; ++tick) EXPECT_EQ(s.step(in).mode, Mode::tracking);
  in.battery_low = false;  // another one
  s.step(in);
  in.battery_low = true;
  EXPECT_EQ(s.step(in).mode, Mode::land);
}

}  // namespace
}  // namespace backwash::track
