// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/frame_alignment.hpp"
#include "tests/track/flown/frames.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

namespace backwash::track {
namespace {

TEST(FrameAlignment, FindsYawAndTranslationAcrossTheWrap) {
  std::mt19937_64 rng(1);
  std::normal_distribution<double> noise(0, 0.005);
  for (const double yaw : {0.0, 0.7, -2.5, 3.1, std::numbers::pi}) {
    const Frames truth(yaw, {12, -7, 0.4});
    FrameAlignment alignment;
    EXPECT_FALSE(alignment.aligned());
    for (int i = 0; i < 200; ++i) {
      const FramePose map{{2 + noise(rng), 3 + noise(rng), 1 + noise(rng)}, 3.0 + noise(rng)};
      FramePose local = truth.local(map);
      local.p += Vec3(noise(rng), noise(rng), noise(rng));
      alignment.update(map, local, kControlPeriod, true);
    }
    ASSERT_TRUE(alignment.aligned()) << yaw;
    const Setpoint sent = alignment.to_local({{2.5, 3.5, 1.2}, {1, 2, 0.5}, {0.1, 0.2, 0.3}, 0.25});
    EXPECT_LT((sent.p_W - truth.local_from_map * Vec3(2.5, 3.5, 1.2)).norm(), 0.01);
    EXPECT_LT((sent.v_W - truth.local_from_map.linear() * Vec3(1, 2, 0.5)).norm(), 0.02);
    EXPECT_LT(std::abs(wrap_angle(sent.yaw - 0.25 - yaw)), 0.01);
  }
}

TEST(FrameAlignment, NoticesWithinAFewTicksThatTheControllerReset) {
  const Frames truth(0.5, {1, 2, 3});
  FrameAlignment alignment;
  const FramePose map{{1, 1, 1}, 0};
  for (int i = 0; i < 100; ++i) alignment.update(map, truth.local(map), kControlPeriod, true);
  ASSERT_TRUE(alignment.aligned());
  FramePose jumped = truth.local(map);
  jumped.p.x() += 0.8;
  int ticks = 0;
  while (alignment.aligned() && ticks < 50) {
    alignment.update(map, jumped, kControlPeriod, false);
    ++ticks;
  }
  EXPECT_LE(ticks, 2);
}

TEST(FrameAlignment, DoesNotAlignFramesThatKeepTurning) {
  FrameAlignment alignment;
  for (int i = 0; i < 300; ++i)
    alignment.update({{1, 1, 1}, 0}, Frames(0.02 * i, {0, 0, 0}).local({{1, 1, 1}, 0}), kControlPeriod, true);
  EXPECT_FALSE(alignment.aligned());
}

// What the controller's own samples say of a reset: jumps against its own velocity and gyros do, its motion does not.
TEST(FrameAlignment, AControllersEstimateJumpedOnlyIfItsOwnMotionDoesNotExplainIt) {
  FrameAlignment alignment;
  const FramePose map{};
  FramePose local{{1, 2, 3}, 0.5, {1.4, 0, 0}};
  local.yaw_rate = 1;
  alignment.update(map, local, kControlPeriod, true);
  for (const double dt : {0.02, 0.04, 0.08}) {
    FramePose next = local;
    next.p.x() += 1.4 * dt;
    next.yaw += dt;
    EXPECT_FALSE(alignment.local_jumped(next, dt));
    FramePose moved = next;
    moved.p.y() += 0.11;
    EXPECT_TRUE(alignment.local_jumped(moved, dt));
    moved.p.y() -= 0.02;
    EXPECT_FALSE(alignment.local_jumped(moved, dt)) << "a pair apart by so little is no reset";
    FramePose turned = next;
    turned.yaw += 0.11;
    EXPECT_TRUE(alignment.local_jumped(turned, dt));
    turned.yaw -= 0.02;
    EXPECT_FALSE(alignment.local_jumped(turned, dt));
  }
  EXPECT_FALSE(alignment.local_jumped({{9, 9, 9}, 0}, 0.2)) << "nothing is carried on over a gap";
}

// Two frames that turn together, as with an autopilot that takes its heading from the odometry: the gyros tell.
TEST(FrameAlignment, FramesThatTurnTogetherAreAlignedOnlyAsFarAsTheGyrosTurn) {
  const auto ticks_aligned = [](double odometry, double gyros) {  // rad/s
    FrameAlignment alignment;
    for (int i = 0; i < 50; ++i) alignment.update({}, {}, kControlPeriod, true);
    int n = 0;
    for (; n < 1000 && alignment.aligned(); ++n) {
      FramePose map{};
      map.yaw = wrap_angle(odometry * n * kControlPeriod);
      FramePose local = map;
      local.yaw_rate = gyros;
      alignment.update(map, local, kControlPeriod, false);
    }
    return n;
  };
  EXPECT_EQ(ticks_aligned(1, 1), 1000);
  EXPECT_EQ(ticks_aligned(-3, -3), 1000);
  EXPECT_EQ(ticks_aligned(0.01, 0), 1000) << "0.6°/s";
  EXPECT_LT(ticks_aligned(0.1, 0), 50);
  EXPECT_LT(ticks_aligned(0, 0.1), 50);
  EXPECT_LE(ticks_aligned(3.6, 0), 2);
}

// An autopilot that reports its pose at 10 Hz, or 4, is used all the same.
TEST(FrameAlignment, ATurnBeyondTheGyrosIsSeenHoweverSeldomThePoseIsReported) {
  for (const double dt : {0.02, 0.1, 0.16, 0.3}) {
    FrameAlignment turning, right;
    double yaw = 0;
    for (int n = 0; n < 30; ++n)
      for (auto* alignment : {&turning, &right}) alignment->update({Vec3(1, 2, 3), 0}, {Vec3(1, 2, 3), 0}, dt, true);
    ASSERT_TRUE(turning.aligned() && right.aligned()) << dt;
    for (double t = 0; t < 3; t += dt) {
      yaw += 0.1 * dt;  // 6°/s; both follow the odometry, the gyros of one say so too
      FramePose local{Vec3(1, 2, 3), yaw};
      turning.update({Vec3(1, 2, 3), yaw}, local, dt, false);
      local.yaw_rate = 0.1;
      right.update({Vec3(1, 2, 3), yaw}, local, dt, false);
    }
    EXPECT_FALSE(turning.aligned()) << dt;
    EXPECT_TRUE(right.aligned()) << dt;
  }
}

TEST(FrameAlignment, IsNotAlignedWhileTheAttitudesAreTilted) {
  FrameAlignment alignment;
  for (int i = 0; i < 50; ++i) alignment.update({}, {}, kControlPeriod, true);
  ASSERT_TRUE(alignment.aligned());
  FramePose tilted{};
  tilted.up_B = Eigen::AngleAxisd(0.17, Vec3(1, 1, 0).normalized()) * Vec3::UnitZ();
  int ticks = 0;
  while (alignment.aligned() && ticks < 50) {
    alignment.update(tilted, {}, kControlPeriod, false);
    ++ticks;
  }
  EXPECT_LE(ticks, 8);
}

}  // namespace
}  // namespace backwash::track
