// SPDX-License-Identifier: BSD-3-Clause
// Odometry that comes seldom or late, as it was stated (docs/model.md 4-13 to 4-15).
#include <gtest/gtest.h>

#include "core/track/frame_alignment.hpp"
#include "core/track/odometry_gate.hpp"
#include "core/track/supervisor.hpp"
#include "core/track/tracker.hpp"
#include "core/types/odometry_timing.hpp"
#include "tests/track/flown/flown.hpp"

namespace backwash::track {
namespace {

constexpr OdometryTiming k10Hz{10, 0};

TEST(OdometryTiming, OfTheUsualOneNothingIsAdded) {
  for (const double rate : {20.0, 30.0, 500.0}) {
    const OdometryTiming timing{rate, 0};
    EXPECT_TRUE(timing.usual());
    EXPECT_EQ(timing.longer_gap(), 0);
    EXPECT_EQ(timing.usual_samples(), 1);
    EXPECT_EQ(timing.lead(), 0u);
    EXPECT_EQ(timing.oldest(), 0.08);
  }
  EXPECT_FALSE((OdometryTiming{19.9, 0}.usual()));
  EXPECT_FALSE((OdometryTiming{100, 0.001}.usual()));
}

// A sample just before HOLD, in a tick that began just before it.
TEST(OdometryTiming, TheLeadIsNoShorterThanTheOldestPose) {
  for (const double rate : {9.0, 10.0, 15.0, 100.0})
    for (const double latency : {0.001, 0.04, 0.12, 0.2}) {
      const OdometryTiming timing{rate, latency};
      EXPECT_NEAR(timing.oldest(), 0.03 + 1 / std::min(rate, 20.0) + latency, 1e-12);
      EXPECT_GE(static_cast<double>(timing.lead()) * 0.02, timing.oldest() + 0.02);
      EXPECT_LT(static_cast<double>(timing.lead()) * 0.02, timing.oldest() + 0.0401);
    }
}

/// `rest` commands at rest at (0, 0, 1), then ten 0.1 m apart along x; entry k of the tube is 0.1 + 0.01 k wide, its
/// interval 0.6 + 0.01 k.
AcceptedSegment segment(int rest) {
  AcceptedSegment s;
  s.id = 1;
  for (int k = 0; k < rest + 10; ++k) {
    const bool moves = k >= rest;
    s.commands.push_back(
        {Vec3(moves ? 0.1 * (k - rest) : 0, 0, 1), moves ? Vec3(5, 0, 0) : Vec3::Zero(), Vec3::Zero(), 0});
  }
  for (int k = 0; k <= rest + 10; ++k) {
    reach::TubeStep step{};
    step.shape = Mat3::Zero();
    step.center.p_W = Vec3(0.1 * std::max(0, k - rest), 0, 1);
    step.half_widths.fill(0.1 + 0.01 * k);
    step.half_widths_interval.fill(0.6 + 0.01 * k);
    s.tube.push_back(step);
  }
  return s;
}

const State kThere{Vec3(0, 0, 1), Vec3::Zero()};

struct Tracked : Tracker {
  Tracked()
      : Tracker(Setpoint{}, [] {
          Vehicle v;
          v.initial_error = {0.1, 0.5};
          return v;
        }()) {}
};

TEST(AgeOfASample, ASegmentIsBegunAsLateAsItsFirstPoseIsOld) {
  const auto s = segment(6);
  for (const auto& [age, at] : {std::pair{0.0, 0u}, {0.001, 1u}, {0.02, 1u}, {0.021, 2u}, {0.1, 5u}, {0.12, 6u}}) {
    Tracked tracker;
    ASSERT_TRUE(tracker.accept(s, kThere, age)) << age;
    EXPECT_EQ(tracker.index(), at) << age;
  }
}

TEST(AgeOfASample, ASegmentThatMovesBeforeItsPoseIsSoOldIsRefused) {
  const auto s = segment(6);
  Tracked tracker;
  EXPECT_FALSE(tracker.accept(s, kThere, 0.145)) << "its eighth command";
  auto turns = segment(6);
  turns.commands[3].yaw = 0.1;
  EXPECT_FALSE(tracker.accept(turns, kThere, 0.1));
  auto elsewhere = segment(6);
  elsewhere.commands[2].p_W.x() = 0.01;
  EXPECT_FALSE(tracker.accept(elsewhere, kThere, 0.1));
  EXPECT_TRUE(tracker.accept(elsewhere, kThere, 0.04));
  EXPECT_FALSE(tracker.accept(s, kThere, 10)) << "older than the whole";
}

TEST(AgeOfASample, APoseIsJudgedAgainstTheSetOfItsOwnMoment) {
  const auto s = segment(0);
  Tracked tracker;
  ASSERT_TRUE(tracker.accept(s, kThere));
  for (int k = 0; k < 6; ++k) tracker.step();
  // Six commands were given: now is entry 6, 50 ms ago 3.5, half way from 0.3 to 0.4 m.
  const Inside then = tracker.judge(Vec3(0.35, 0, 1), 0.05);
  EXPECT_NEAR(then.error[kX], 0, 1e-12);
  EXPECT_DOUBLE_EQ(then.half_widths[kX], 0.63) << "until entry 4";
  EXPECT_NEAR(tracker.judge(Vec3(0.35, 0, 1)).error[kX], -0.25, 1e-12);
  EXPECT_NEAR(tracker.judge(Vec3(0, 0, 1), 0.3).error[kX], 0, 1e-12) << "before the segment: where it begins";
}

TEST(AgeOfASample, PastTheEndThePoseCatchesUp) {
  const auto s = segment(0);
  Tracked tracker;
  ASSERT_TRUE(tracker.accept(s, kThere));
  for (int k = 0; k < 10; ++k) tracker.step();  // entry 10, 1.0 m, is now
  for (int past = 0; past < 8; ++past) {
    const double center = std::min(1.0, 0.1 * (past + 10 - 5));
    EXPECT_NEAR(tracker.judge(Vec3(0, 0, 1), 0.1).center.x(), center, 1e-9) << past;
    tracker.step();
  }
}

OdometrySample sample(double t, const Vec3& p, const Vec3& v) {
  OdometrySample s;
  s.received_ns = s.stamp_ns = static_cast<std::int64_t>(t * 1e9);
  s.state = {p, v};
  return s;
}

Vehicle gated() {
  Vehicle v;
  v.limits.v_max = 1.5;
  v.estimation.position = 0.02;
  return v;
}

TEST(SlowOdometryGate, IdenticalPosesAreFrozenNoLaterThanAtTwentyHertz) {
  for (const auto& [rate, needed] : {std::pair{20.0, 5}, {15.0, 4}, {10.0, 3}, {9.0, 3}, {100.0, 5}}) {
    OdometryGate gate(gated(), {rate, 0});
    int n = 1;
    while (gate.take(sample(n / rate, Vec3(1, 0, 1), Vec3::Zero()), true) == OdometryGate::Verdict::good) ++n;
    EXPECT_EQ(n, needed) << rate;
  }
}

// Positions creep while the velocity says that nothing moves: at 10 Hz as well, and with a gap that is late.
TEST(SlowOdometryGate, FindsPositionsThatGoAnotherWayThanTheVelocities) {
  const auto found = [](const OdometryTiming& timing) {
    OdometryGate gate(gated(), timing);
    for (int n = 0; n < 30; ++n)
      if (gate.take(sample(0.115 * n, Vec3(0.04 * n, 0, 1), Vec3::Zero()), false) ==
          OdometryGate::Verdict::inconsistent)
        return true;
    return false;
  };
  EXPECT_TRUE(found(k10Hz));
  EXPECT_FALSE(found({})) << "where gaps are longer than what is held against each other it cannot be seen";
}

// 0.12 m between the two estimates: noticed after as long as at 20 Hz.
TEST(SlowFrameAlignment, ResidualsGrowAsFastByTheClock) {
  const auto seconds_to = [](double rate, const OdometryTiming& timing) {
    FrameAlignment frames(timing);
    FramePose here;
    for (int n = 0; n < 200; ++n) frames.update(here, here, 1 / rate, true);
    FramePose off;
    off.p.x() = 0.12;
    int n = 0;
    while (frames.position_residual() < 0.1) {
      frames.update(here, off, 1 / rate, false);
      ++n;
    }
    return n / rate;
  };
  EXPECT_LE(seconds_to(10, k10Hz), seconds_to(20, {}) + 0.1);
  EXPECT_GT(seconds_to(10, {}), 1.5 * seconds_to(20, {}));
}

TEST(SlowSupervisor, WaitsForTheLongerGapAndNoMore) {
  const auto mode_at = [](const OdometryTiming& timing, double age) {
    Supervisor s(timing);
    SupervisorInput in;
    in.armed = in.offboard = in.frames_aligned = true;
    in.request = Request::enable;
    s.step(in);
    in.request = Request::none;
    for (int n = 0; n < 3; ++n) s.step(in);
    EXPECT_EQ(s.mode(), Mode::tracking) << to_string(s.reason());
    in.odometry_age = age;
    return s.step(in).mode;
  };
  EXPECT_EQ(mode_at(k10Hz, 0.1299), Mode::tracking);
  EXPECT_EQ(mode_at(k10Hz, 0.1301), Mode::hold);
  EXPECT_EQ(mode_at({}, 0.0801), Mode::hold);
  EXPECT_EQ(mode_at({200, 0}, 0.0799), Mode::tracking);
  EXPECT_EQ(mode_at({200, 0}, 0.0801), Mode::hold);
}

}  // namespace
}  // namespace backwash::track

namespace backwash::track::test {
namespace {

TEST(UsualTiming, APoseIsJudgedAgainstTheSetOfTheTickHoweverOldItIsWithinIt) {
  Flown flown;
  flown.age_ns = 15'000'000;
  for (int n = 0; n < 5; ++n) {
    const TickOutput& out = flown.step();
    ASSERT_TRUE(out.inside.judged);
    EXPECT_EQ(out.inside.center, flown.segment.tube[out.judged_index].center.p_W);
    EXPECT_EQ(out.inside.half_widths, flown.segment.tube[out.judged_index].half_widths);
  }
}

}  // namespace
}  // namespace backwash::track::test
