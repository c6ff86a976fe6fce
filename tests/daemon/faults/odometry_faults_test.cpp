// SPDX-License-Identifier: BSD-3-Clause
// Rows 1 to 3, 5, 6, 16, 30, 43 and 49 of docs/faults.md in lockstep: what the VIO can do wrong.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/config/config.hpp"
#include "core/track/odometry_gate.hpp"
#include "firmware_bridge/mavlink/frames.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

/// From the middle of a route at 1 m/s: HOLD within 100 ms of the last good sample (frozen: one position, no velocity),
/// LAND within 400 ms, then QUIET and not a byte more.
void expect_hold_land_quiet(Lockstep& rig, std::int64_t last_good_ns) {
  const auto since = [&] { return static_cast<double>(rig.now_ns() - last_good_ns) * 1e-6; };
  Setpoint last = rig.in_map(rig.wire().setpoints.at(0));
  while (rig.mode() == Mode::tracking) {
    last = rig.in_map(rig.wire().setpoints.at(0));
    rig.tick();
    ASSERT_LE(since(), 100) << "still tracking";
  }
  ASSERT_EQ(rig.mode(), Mode::hold) << to_string(rig.reason());
  while (rig.mode() == Mode::hold) {
    ASSERT_EQ(rig.wire().setpoints.size(), 1u);
    const Setpoint s = rig.in_map(rig.wire().setpoints[0]);
    EXPECT_LT((s.p_W - last.p_W).norm(), 1e-3);
    EXPECT_EQ(s.v_W, Vec3::Zero());
    EXPECT_EQ(s.a_W, Vec3::Zero());
    rig.tick();
    ASSERT_LE(since(), 400) << "still holding";
  }
  ASSERT_EQ(rig.mode(), Mode::land) << to_string(rig.reason());
  EXPECT_TRUE(rig.wire().commanded(kCommandLand));
  while (rig.mode() == Mode::land) {
    EXPECT_TRUE(rig.wire().setpoints.empty());
    rig.tick();
    ASSERT_LE(since(), 700) << "not quiet";
  }
  ASSERT_EQ(rig.mode(), Mode::quiet);
  for (int n = 0; n < 100; ++n) EXPECT_EQ(rig.tick().bytes, 0u);
}

TEST(VioSilenceFault, HoldsWithin100msLandsWithin400AndSendsNothingAfterwards) {
  // The last sample comes just before a tick, and just after one.
  for (const int age : {0, 19}) {
    Lockstep rig;
    rig.vio_age_steps = age;
    rig.take_off();
    rig.start_route(2);
    rig.vio_on = false;
    const std::int64_t last = rig.now_ns() - age * 1'000'000;
    rig.tick();
    expect_hold_land_quiet(rig, last);
  }
}

// The rig's samples, seen `lag` seconds after they were taken: positions, velocities and stamps are those of then.
class Late {
 public:
  void operator()(OdometrySample& s) {
    past_.push_back(s);
    lag += growth;
    const auto wanted = s.stamp_ns - std::llround(lag * 1e9);
    s.stamp_ns = wanted;
    const auto after = std::ranges::find_if(past_, [&](const auto& p) { return p.stamp_ns >= wanted; });
    if (after == past_.begin()) return;  // it stands still
    const auto &a = *std::prev(after), &b = *after;
    const double share = static_cast<double>(wanted - a.stamp_ns) / static_cast<double>(b.stamp_ns - a.stamp_ns);
    s.state.p_W = a.state.p_W + share * (b.state.p_W - a.state.p_W);
    s.state.v_W = a.state.v_W + share * (b.state.v_W - a.state.v_W);
    s.q = b.q;
  }
  double lag = 0, growth = 0;  // s, s a tick

 private:
  std::vector<OdometrySample> past_;
};

TEST(VioLatenessFault, AVioThatFallsBehindByItsOwnStampsIsAsOneThatStops) {
  for (const double profile : {0.0, 0.03}) {
    Lockstep rig;
    Late late;
    late.lag = profile;  // what it always takes
    rig.spoil = std::ref(late);
    rig.take_off();
    rig.start_route(2);
    late.growth = 0.002;
    rig.tick();
    // It stops before, when what it says has left the set.
    while (rig.reason() != Reason::odometry_lost && late.lag < 0.3) rig.tick();
    EXPECT_EQ(rig.mode(), Mode::hold) << to_string(rig.reason());
    EXPECT_NEAR(late.lag - profile, track::Supervisor::kHoldAfter, 0.005) << profile;
    const Vec3 held = rig.in_map(rig.wire().setpoints.at(0)).p_W;
    EXPECT_GT(rig.ticks_until(Mode::land, 20), 0);
    EXPECT_LT((rig.view().command.p_W - held).norm(), 1e-3);
  }
}

// A stamp that is ahead would let the gate through whatever can be reached by then.
TEST(VioLatenessFault, StampsAheadOfTheirReceptionWidenNoGate) {
  for (const double jump : {0.13, 0.5}) {
    Lockstep rig;
    rig.take_off();
    rig.start_route(2);
    rig.spoil = [&](OdometrySample& s) {
      s.stamp_ns += 400'000'000;
      s.state.p_W.y() += jump;
    };
    rig.tick();
    EXPECT_EQ(rig.mode(), Mode::hold);
    EXPECT_EQ(rig.reason(), Reason::odometry_jump);
  }
}

TEST(VioJumpFault, AJumpIsHeldInTheSameTick) {
  for (const double jump : {0.2, -3.0}) {
    Lockstep rig;
    rig.take_off();
    rig.start_route(2);
    const std::int64_t last = rig.now_ns();
    rig.spoil = [=](auto& s) { s.state.p_W.y() += jump; };
    const Setpoint before = rig.in_map(rig.wire().setpoints.at(0));
    rig.tick();
    EXPECT_EQ(rig.mode(), Mode::hold);
    EXPECT_EQ(rig.reason(), Reason::odometry_jump);
    EXPECT_LT((rig.in_map(rig.wire().setpoints.at(0)).p_W - before.p_W).norm(), 1e-3);
    expect_hold_land_quiet(rig, last);
  }
}

TEST(VioStampFault, DuplicatesAndStampsThatGoBackAreDroppedAndMoreThanThreeInARowHold) {
  for (const std::int64_t back_ns : {0, 100'000'000}) {
    Lockstep rig;
    rig.take_off();
    rig.start_route(2);
    const std::uint64_t rejected = rig.view().shown.odometry_rejected;
    std::int64_t stamp = rig.now_ns() - back_ns;
    const auto spoil = [&](OdometrySample& s) { s.stamp_ns = stamp; };
    rig.spoil = spoil;
    rig.ticks(3);
    EXPECT_EQ(rig.view().shown.odometry_rejected - rejected, 3u);
    EXPECT_EQ(rig.mode(), Mode::tracking);
    rig.spoil = nullptr;
    rig.ticks(10);
    EXPECT_EQ(rig.view().shown.odometry_rejected - rejected, 3u);
    EXPECT_EQ(rig.mode(), Mode::tracking);
    const std::int64_t last = rig.now_ns();
    stamp = last - back_ns;
    rig.spoil = spoil;
    rig.ticks(3);
    EXPECT_EQ(rig.mode(), Mode::tracking);
    rig.tick();
    EXPECT_EQ(rig.mode(), Mode::hold);
    EXPECT_EQ(rig.reason(), Reason::odometry_disorder);
    expect_hold_land_quiet(rig, last);
  }
}

TEST(VioFreezeFault, FiveIdenticalPosesUnderCommandedMotionHold) {
  Lockstep rig;
  rig.take_off();
  rig.start_route(2);
  std::optional<OdometrySample> frozen;
  rig.spoil = [&](OdometrySample& s) {
    if (!frozen) frozen = s;
    s.state = frozen->state;
    s.q = frozen->q;
  };
  // The first one, then three that repeat it: still tracking.
  rig.ticks(4);
  EXPECT_EQ(rig.mode(), Mode::tracking) << to_string(rig.reason());
  rig.tick();
  EXPECT_EQ(rig.mode(), Mode::hold);
  EXPECT_EQ(rig.reason(), Reason::odometry_frozen);
}

// The measured position leaves the tube with 5 m/s², as in a gust, and its velocity says so: nothing for the gate.
TEST(OutsideTheSetFault, AnErrorOutsideItsSetIsAnEventAtOnceAndHoldsAfterThreeTicks) {
  Lockstep rig;
  rig.take_off();
  rig.start_route(2);
  double t = 0;
  rig.spoil = [&](OdometrySample& s) {
    t += kControlPeriod;
    s.state.p_W.y() += 2.5 * t * t;
    s.state.v_W.y() += 5 * t;
  };
  int outside = 0;
  for (int n = 0; n < 60 && rig.mode() == Mode::tracking; ++n) {
    rig.tick();
    outside = rig.view().shown.samples_outside > 0 ? outside + 1 : 0;
  }
  EXPECT_EQ(rig.view().shown.samples_outside, 3u);
  EXPECT_EQ(outside, 3);
  EXPECT_EQ(rig.mode(), Mode::hold);
  EXPECT_EQ(rig.reason(), Reason::outside_set);
}

TEST(WallClockFault, AStepOfTheViosByAnHourChangesNothing) {
  for (const std::int64_t hours : {1, -1}) {
    Lockstep rig;
    rig.take_off();
    rig.start_route(1);
    const std::uint64_t rejected = rig.view().shown.odometry_rejected, missed = rig.view().shown.ticks_missed;
    rig.spoil = [=](OdometrySample& s) { s.stamp_ns += hours * 3600 * 1'000'000'000; };
    for (int n = 0; n < 150; ++n) {
      // What is forwarded is in the clock of our answers to TIMESYNC all the same.
      ASSERT_EQ(rig.tick().odometry, 1);
      EXPECT_LE(std::abs(static_cast<double>(rig.wire().odometry_us) - static_cast<double>(rig.now_ns()) * 1e-3), 1000);
    }
    EXPECT_EQ(rig.mode(), Mode::tracking) << to_string(rig.reason());
    EXPECT_EQ(rig.view().shown.odometry_rejected, rejected);
    EXPECT_EQ(rig.view().shown.ticks_missed, missed);
    EXPECT_EQ(rig.view().shown.samples_outside, 0u);
  }
}

// What was flown on until an attack found it (docs/faults.md rows 4 and 6).

TEST(VioFreezeFault, IdenticalPosesOnTheGroundAreNoFault) {
  Lockstep rig;
  rig.ticks(50);
  std::optional<OdometrySample> frozen;
  rig.spoil = [&](OdometrySample& s) {
    if (!frozen) frozen = s;
    s.state = frozen->state;
    s.q = frozen->q;
  };
  rig.ticks(25);
  EXPECT_TRUE(rig.channels->orders.push({track::Request::enable}));
  EXPECT_GT(rig.ticks_until(Mode::tracking, 250), 0) << to_string(rig.reason());
  rig.ticks(25);
  EXPECT_EQ(rig.mode(), Mode::tracking) << to_string(rig.reason());
}

// Fresh stamps, the same pose to the last bit: the autopilot believes it and drifts, 0.6 m in 5 s and 25 m in a minute.
// Nothing compares identical poses unless a velocity is commanded.
TEST(VioFreezeFault, AVioThatFreezesInAHoverIsHeldBeforeTheVehicleHasDriftedAway) {
  for (const bool follows_yaw : {false, true}) {
    Lockstep rig;
    rig.autopilot->follows_yaw = follows_yaw;
    rig.take_off();
    rig.ticks(100);
    std::optional<OdometrySample> frozen;
    rig.spoil = [&](OdometrySample& s) {
      if (!frozen) {
        frozen = s;
        frozen->state.v_W.setZero();
      }
      s.state = frozen->state;
      s.q = frozen->q;
    };
    EXPECT_GT(rig.ticks_until(Mode::hold, 7), 0) << "flown on a frozen pose";
    EXPECT_GT(rig.ticks_until(Mode::land, 60), 0);
  }
}

}  // namespace
}  // namespace backwash::daemon::test
