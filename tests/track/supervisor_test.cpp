// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/supervisor.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <string>

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

TEST(Supervisor, RefusesToEnableWithoutOdometryOrHeartbeat) {
  for (const bool odometry : {true, false}) {
    Supervisor s;
    SupervisorInput in = healthy();
    (odometry ? in.odometry_age : in.heartbeat_age) = std::numeric_limits<double>::infinity();
    in.request = Request::enable;
    EXPECT_EQ(s.step(in).mode, Mode::passive);
  }
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

TEST(Supervisor, GoesQuietWhenTheLinkOrTheClockFails) {
  const auto expect_quiet = [](Reason reason, auto change) {
    Supervisor s = flying();
    EXPECT_EQ(ticks_until(s, Mode::quiet, 2, change), 1) << to_string(reason);
    EXPECT_EQ(s.reason(), reason);
    // A link that comes back changes nothing until an operator enables again.
    EXPECT_EQ(s.step(healthy()).mode, Mode::quiet);
  };
  expect_quiet(Reason::port_lost, [](auto& in, int) { in.port_open = false; });
  expect_quiet(Reason::transmit_full, [](auto& in, int) { in.transmit_failed = true; });
  expect_quiet(Reason::autopilot_silent, [](auto& in, int) { in.heartbeat_age = 1.51; });
  expect_quiet(Reason::clock_stopped, [](auto& in, int) { in.missed_periods = 25; });
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

}  // namespace
}  // namespace backwash::track
