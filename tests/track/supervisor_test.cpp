// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <optional>
#include <string>

#include "core/track/supervisor.hpp"
#include "core/types/geometry.hpp"
#include "tests/track/flown/healthy.hpp"

namespace backwash::track {
namespace {

// A supervisor that an operator enabled and the autopilot follows.
Supervisor flying() {
  Supervisor s;
  SupervisorInput in = healthy();
  in.request = Request::enable;
  s.step(in);
  in.request = Request::none;
  s.step(in);
  EXPECT_EQ(s.mode(), Mode::tracking);
  return s;
}

// Steps until the mode is `wanted`; returns the ticks it took, or −1 after `most`.
template <typename Change>
int ticks_until(Supervisor& s, Mode wanted, int most, Change change) {
  for (int tick = 1; tick <= most; ++tick) {
    SupervisorInput in = healthy();
    change(in, tick);
    if (s.step(in).mode == wanted) return tick;
  }
  return -1;
}

TEST(Supervisor, SendsNothingAfterAStartWithTheVehicleArmed) {
  Supervisor s;
  for (int tick = 0; tick < 100; ++tick) {
    const auto out = s.step(healthy());
    EXPECT_EQ(out.mode, Mode::passive);
    EXPECT_FALSE(out.send_setpoint || out.send_heartbeat || out.request_offboard || out.request_land);
  }
}

TEST(Supervisor, NeverStreamsSetpointsUnlessEnabled) {
  Supervisor s;
  SupervisorInput in = healthy();
  in.armed = false;
  for (int tick = 0; tick < 100; ++tick) EXPECT_FALSE(s.step(in).send_setpoint);
}

TEST(Supervisor, StreamsBeforeItAsksForOffboardAndOnlyInAlignedFrames) {
  Supervisor s;
  SupervisorInput in = healthy();
  in.armed = in.offboard = in.frames_aligned = false;
  in.request = Request::enable;
  s.step(in);
  in.request = Request::none;
  for (int tick = 0; tick < 20; ++tick) EXPECT_FALSE(s.step(in).send_setpoint);
  in.frames_aligned = true;
  int streamed = 0, asked_after = -1;
  for (int tick = 0; tick < 150 && asked_after < 0; ++tick) {
    const auto out = s.step(in);
    streamed += out.send_setpoint;
    if (out.request_offboard) asked_after = streamed;
  }
  EXPECT_GE(asked_after, 25);
}

TEST(Supervisor, GivesUpEnablingAfterFiveSeconds) {
  Supervisor s;
  SupervisorInput in = healthy();
  in.offboard = false;
  in.request = Request::enable;
  s.step(in);
  EXPECT_EQ(ticks_until(s, Mode::passive, 300, [](auto& i, int) { i.offboard = false; }), 251);
  EXPECT_EQ(s.reason(), Reason::enable_timeout);
}

TEST(Supervisor, HoldsWithin100msLandsWithin400msThenGoesQuietWhenOdometryStops) {
  Supervisor s = flying();
  // The worst phase: the last sample arrived just after a tick, so the first tick sees it one period old.
  const auto lost = [](auto& in, int tick) { in.odometry_age = tick * kControlPeriod; };
  const int hold = ticks_until(s, Mode::hold, 50, lost);
  EXPECT_GT(hold, 0);
  EXPECT_LE(hold * kControlPeriod, 0.100 + 1e-9);
  int tick = hold;
  SupervisorInput in = healthy();
  SupervisorOutput out;
  do {
    in.odometry_age = ++tick * kControlPeriod;
    out = s.step(in);
    if (out.mode == Mode::hold) {
      EXPECT_TRUE(out.freeze && out.send_setpoint);
    }
  } while (out.mode == Mode::hold && tick < 100);
  EXPECT_EQ(out.mode, Mode::land);
  EXPECT_TRUE(out.request_land);
  EXPECT_FALSE(out.send_setpoint);
  EXPECT_LE(tick * kControlPeriod, 0.400 + 1e-9);
  EXPECT_GT(ticks_until(s, Mode::quiet, 50, [](auto& i, int) { i.odometry_age = 1; }), 0);
  out = s.step(healthy());
  EXPECT_FALSE(out.send_setpoint || out.send_heartbeat || out.request_land);
}

TEST(Supervisor, ComesBackFromAnUntrustedPoseOnlyByLanding) {
  Supervisor s = flying();
  ticks_until(s, Mode::hold, 50, [](auto& in, int) { in.odometry_jump = true; });
  EXPECT_EQ(s.reason(), Reason::odometry_jump);
  const int land = ticks_until(s, Mode::land, 50, [](auto& in, int) { in.new_segment = true; });
  EXPECT_GT(land, 0);
  EXPECT_LE(land * kControlPeriod, 0.4);
}

TEST(Supervisor, HoldsAfterThreeTicksOutsideTheSetAndNotBefore) {
  Supervisor s = flying();
  EXPECT_EQ(ticks_until(s, Mode::hold, 20, [](auto& in, int tick) { in.inside = tick % 3 == 0; }), -1);
  s.step(healthy());
  EXPECT_EQ(ticks_until(s, Mode::hold, 20, [](auto& in, int) { in.inside = false; }), Supervisor::kOutsideTicks);
  EXPECT_EQ(ticks_until(s, Mode::tracking, 20, [](auto& in, int) { in.new_segment = true; }), 1);
}

TEST(Supervisor, NeverFightsAPilotWhoLeavesOffboard) {
  Supervisor s = flying();
  EXPECT_EQ(ticks_until(s, Mode::passive, 2, [](auto& in, int) { in.offboard = false; }), 1);
  for (int tick = 0; tick < 500; ++tick) {
    SupervisorInput in = healthy();
    in.offboard = false;
    const auto out = s.step(in);
    EXPECT_FALSE(out.request_offboard || out.send_setpoint);
  }
}

// Both of its commands were lost: an autopilot in GUIDED hovers, or goes on climbing in its own take-off.
TEST(Supervisor, AsksForLandAgainWhenAnOperatorDoesOfAnAutopilotThatStillFollows) {
  for (const Request again : {Request::land, Request::stop}) {
    Supervisor s = flying();
    SupervisorInput in = healthy();
    in.request = Request::land;
    s.step(in);
    in.request = Request::none;
    int asked = 0;
    for (int tick = 0; tick < 100; ++tick) asked += s.step(in).request_land;
    EXPECT_EQ(asked, 1) << "the second of the first two";
    in.request = again;
    asked = s.step(in).request_land;
    in.request = Request::none;
    for (int tick = 0; tick < 100; ++tick) asked += s.step(in).request_land;
    EXPECT_EQ(asked, 2);
    in.offboard = false;
    in.request = again;
    EXPECT_FALSE(s.step(in).request_land) << "it lands, or a pilot has it";
  }
}

TEST(Supervisor, LandsOnRequestAndIsPassiveOnceDisarmed) {
  Supervisor s = flying();
  SupervisorInput in = healthy();
  in.request = Request::land;
  EXPECT_TRUE(s.step(in).request_land);
  EXPECT_EQ(ticks_until(s, Mode::quiet, 100, [](auto& i, int) { i.offboard = false; }), -1);
  EXPECT_EQ(ticks_until(s, Mode::passive, 2, [](auto& i, int) { i.armed = i.offboard = false; }), 1);
  EXPECT_EQ(s.reason(), Reason::landed);
}

// Row 42.
TEST(Supervisor, HoldsAndThenLandsWhenTheAutopilotsPoseGrowsOldAndDoesNotEnableOnIt) {
  Supervisor s = flying();
  const auto silent = [](auto& in, int tick) { in.pose_age = tick * kControlPeriod; };
  EXPECT_EQ(ticks_until(s, Mode::hold, 50, silent), 15);
  EXPECT_EQ(s.reason(), Reason::pose_silent);
  EXPECT_TRUE(s.pose_trusted()) << "the odometry is: it stops on a verified way";
  SupervisorInput in = healthy();
  in.pose_age = 0.98;
  EXPECT_EQ(s.step(in).mode, Mode::hold);
  in.pose_age = 1.0;
  EXPECT_TRUE(s.step(in).request_land);
  EXPECT_EQ(s.reason(), Reason::pose_lost);
  for (const double age : {0.31, 10.0, std::numeric_limits<double>::infinity()}) {
    Supervisor fresh;
    in = healthy();
    in.pose_age = age;
    in.request = Request::enable;
    EXPECT_EQ(fresh.step(in).mode, Mode::passive);
    EXPECT_EQ(fresh.reason(), Reason::pose_silent);
  }
}

// The table of docs/modes.md, as the code would write it: neighbours of the same modes are one row.
std::string table() {
  std::string text = "| in | when | to |\n| --- | --- | --- |\n", before;
  for (const Transition& t : transitions()) {
    std::string from = "|";
    for (int m = 0; m < kModes; ++m)
      if (contains(t.from, static_cast<Mode>(m)))
        from += (from == "|" ? " " : ", ") + std::string(to_string(static_cast<Mode>(m)));
    const std::string when = to_string(t.when), to = std::string(" | ") + to_string(t.to) + " |\n";
    text = from + to == before ? text.insert(text.size() - to.size(), "; " + when) : text + from + " | " + when + to;
    before = from + to;
  }
  return text;
}

TEST(Supervisor, ASlowLineTakesNoOtherReasonsPlaceInAHold) {
  Supervisor s = flying();
  int changes = 0;
  for (int tick = 0; tick < 50; ++tick) {
    SupervisorInput in = healthy();
    in.line_slow = in.frames_apart = true;
    changes += s.step(in).changed;
  }
  EXPECT_LE(changes, 2) << "each is told, logged, and ends what is planned";
}

TEST(Supervisor, IsDocumentedAsItIs) {
  std::ifstream in(BACKWASH_SOURCE_DIR "/docs/modes.md");
  const std::string document{std::istreambuf_iterator<char>(in), {}};
  EXPECT_NE(document.find(table()), std::string::npos) << "docs/modes.md should hold:\n" << table();
  std::string refused;
  for (const Reason reason : refusals()) refused += (refused.empty() ? "" : "; ") + std::string(to_string(reason));
  EXPECT_NE(document.find("\n| " + refused + " |\n"), std::string::npos) << refused;
}

TEST(Supervisor, EveryModeAndReasonHasANameOfItsOwn) {
  for (int a = 0; a < kReasons; ++a) {
    EXPECT_LE(std::string(to_string(static_cast<Reason>(a))).size(), 50u);  // a STATUSTEXT holds it whole
    for (int b = 0; b < a; ++b) EXPECT_STRNE(to_string(static_cast<Reason>(a)), to_string(static_cast<Reason>(b)));
  }
  EXPECT_STREQ(to_string(static_cast<Reason>(kReasons - 1)), "line to the autopilot slower than sets allow for");
  EXPECT_STREQ(to_string(static_cast<Reason>(kReasons)), "?");
}

TEST(Supervisor, ThreeMissedDeadlinesHoldOnlyWithinOneSecond) {
  for (const int apart : {24, 25, 26}) {  // the first and the third are 2·apart periods from each other
    Supervisor s = flying();
    SupervisorInput late = healthy();
    late.missed_periods = 1;
    for (int miss = 0; miss < 3; ++miss) {
      s.step(late);
      for (int tick = 0; tick < apart - 2; ++tick) s.step(healthy());
    }
    EXPECT_EQ(s.mode(), 2 * apart <= 50 ? Mode::hold : Mode::tracking) << apart;
  }
  Supervisor s = flying();
  SupervisorInput late = healthy();
  late.missed_periods = 3;
  s.step(late);
  EXPECT_EQ(s.mode(), Mode::hold);
  EXPECT_EQ(s.reason(), Reason::deadline_missed);
}

TEST(Supervisor, AHoldThatComesToDistrustThePoseLandsOnlyAfterItsOwnTime) {
  Supervisor s = flying();
  SupervisorInput in = healthy();
  in.outside_map = true;
  EXPECT_EQ(s.step(in).mode, Mode::hold);
  for (int tick = 0; tick < 200; ++tick) EXPECT_EQ(s.step(healthy()).mode, Mode::hold);
  in = healthy();
  in.odometry_jump = true;
  auto out = s.step(in);
  EXPECT_EQ(out.mode, Mode::hold);
  EXPECT_TRUE(out.freeze);
  int ticks = 1;
  while (s.step(healthy()).mode == Mode::hold && ticks < 50) ++ticks;
  EXPECT_EQ(s.mode(), Mode::land);
  EXPECT_GE(ticks, 10);
  EXPECT_LE(ticks * kControlPeriod, 0.4);
}

// Every fact by itself: which mode and reason it leads to, from flight, from enabling and as a refusal to enable.

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
