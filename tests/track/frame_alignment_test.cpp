// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "core/track/frame_alignment.hpp"
#include "tests/track/flown/frames.hpp"

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

/// Learnt from a vehicle at rest, then watched with the local pose off by this much until the residuals have settled.
FrameAlignment watched(const Vec3& off, double turned) {
  const Frames truth(0.5, {1, 2, 3});
  const FramePose map{{1, 1, 1}, 0.2};
  FrameAlignment alignment;
  for (int i = 0; i < 50; ++i) alignment.update(map, truth.local(map), kControlPeriod, true);
  FramePose local = truth.local(map);
  local.p += off;
  local.yaw += turned;
  for (int i = 0; i < 200; ++i) alignment.update(map, local, kControlPeriod, false);
  return alignment;
}

// docs/interfaces.md: residual below 5 cm and 3°.
TEST(FrameAlignmentLimits, EndsAtFiveCentimetresAndThreeDegreesAndNowhereElse) {
  constexpr double kDegree = std::numbers::pi / 180;
  for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(0.6, 0, -0.8)}) {
    EXPECT_TRUE(watched(0.049 * axis, 0).aligned()) << axis.transpose();
    EXPECT_FALSE(watched(0.051 * axis, 0).aligned()) << axis.transpose();
  }
  for (const double sign : {-1.0, 1.0}) {
    EXPECT_TRUE(watched(Vec3::Zero(), sign * 2.9 * kDegree).aligned());
    EXPECT_FALSE(watched(Vec3::Zero(), sign * 3.1 * kDegree).aligned());
  }
}

TEST(FrameAlignmentLimits, NeedsHalfASecondOfSamples) {
  const Frames truth(0.5, {1, 2, 3});
  const FramePose map{{1, 1, 1}, 0.2};
  FrameAlignment alignment;
  for (int i = 1; i <= 25; ++i) {
    alignment.update(map, truth.local(map), kControlPeriod, true);
    EXPECT_EQ(alignment.aligned(), i == 25) << i;
  }
}

TEST(FrameAlignmentLimits, TellsAResetFromNoiseByPositionAndByHeading) {
  constexpr double kDegree = std::numbers::pi / 180;
  const Frames truth(0.5, {1, 2, 3});
  const FramePose map{{1, 1, 1}, 0.2};
  const FrameAlignment alignment = watched(Vec3::Zero(), 0);
  const auto off = [&](const Vec3& by, double turned) {
    FramePose local = truth.local(map);
    local.p += by;
    local.yaw += turned;
    return alignment.reset_between(map, local);
  };
  EXPECT_FALSE(off({0, 0.14, 0}, 0));
  EXPECT_TRUE(off({0, 0.16, 0}, 0));
  EXPECT_FALSE(off(Vec3::Zero(), -8.9 * kDegree));
  EXPECT_TRUE(off(Vec3::Zero(), -9.1 * kDegree));
  EXPECT_FALSE(FrameAlignment().reset_between(map, {{9, 9, 9}, 3})) << "nothing was learnt yet";
}

// Every part of a command goes out in the controller's frame.
TEST(FrameAlignmentLimits, TurnsEveryPartOfACommand) {
  const Frames truth(0.5, {1, 2, 3});
  const Setpoint sent = watched(Vec3::Zero(), 0).to_local({{2, -1, 0.5}, {1, 2, 0.5}, {0.1, 0.2, 0.3}, 3.0});
  EXPECT_LT((sent.p_W - truth.local_from_map * Vec3(2, -1, 0.5)).norm(), 1e-9);
  EXPECT_LT((sent.v_W - truth.local_from_map.linear() * Vec3(1, 2, 0.5)).norm(), 1e-9);
  EXPECT_LT((sent.a_W - truth.local_from_map.linear() * Vec3(0.1, 0.2, 0.3)).norm(), 1e-9);
  EXPECT_NEAR(sent.yaw, wrap_angle(3.5), 1e-9);
}

TEST(FrameAlignmentLimits, AFrozenAlignmentDoesNotFollow) {
  const FrameAlignment alignment = watched({0.03, 0, 0}, 0);
  const Frames truth(0.5, {1, 2, 3});
  EXPECT_LT((alignment.to_local({{2, -1, 0.5}}).p_W - truth.local_from_map * Vec3(2, -1, 0.5)).norm(), 1e-9);
  EXPECT_NEAR(alignment.position_residual(), 0.03, 1e-6);
}

// Row 7: what carrying the vehicle about before it is enabled shows of frames that do not match.

/// Six seconds of motion along all axes; `wrong` changes what the controller says of it.
Mismatch after(const std::function<void(FramePose&)>& wrong) {
  FrameAlignment alignment;
  for (int n = 0; n < 300; ++n) {
    const double t = 0.02 * n;
    // Circles: no two axes move alike, which a turn could explain.
    const FramePose map{{std::sin(2 * t) / 2, -std::cos(2 * t) / 2, 0.5 * std::sin(0.9 * t)},
                        0.3,
                        {std::cos(2 * t), std::sin(2 * t), 0.45 * std::cos(0.9 * t)}};
    FramePose local = map;
    wrong(local);
    alignment.update(map, local, 0.02, true);
  }
  return alignment.mismatch();
}

Vec3 up_tilted(const Vec3& axis, double angle) { return Eigen::AngleAxisd(angle, axis) * Vec3::UnitZ(); }

TEST(FrameMismatch, FramesThatMatchShowNone) {
  EXPECT_EQ(after([](auto&) {}), Mismatch::none);
}

TEST(FrameMismatch, NamesTheAxisThatIsMirroredOrDead) {
  const Mismatch names[] = {Mismatch::x, Mismatch::y, Mismatch::z};
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(after([=](auto& l) {
                l.p[axis] *= -1;
                l.v[axis] *= -1;
              }),
              names[axis]);
    EXPECT_EQ(after([=](auto& l) { l.v[axis] = 0; }), names[axis]);
  }
}

TEST(FrameMismatch, NamesAYawOfMoreThanTenDegrees) {
  const auto turned = [](double degrees) {
    return after([=](auto& l) {
      const Eigen::AngleAxisd R(degrees * std::numbers::pi / 180, Vec3::UnitZ());
      l.p = R * l.p;
      l.v = R * l.v;  // the heading is right, the motion is in another frame
    });
  };
  for (const double sign : {-1.0, 1.0}) {
    EXPECT_EQ(turned(sign * 9), Mismatch::none);
    EXPECT_EQ(turned(sign * 11), Mismatch::yaw);
    EXPECT_EQ(turned(sign * 90), Mismatch::yaw);
  }
}

TEST(FrameMismatch, NamesATiltOfMoreThanFiveDegrees) {
  const auto tilted = [](const Vec3& axis, double degrees) {
    return after([=](auto& l) { l.up_B = up_tilted(axis, degrees * std::numbers::pi / 180); });
  };
  for (const double sign : {-1.0, 1.0}) {
    EXPECT_EQ(tilted(Vec3::UnitX(), sign * 4.8), Mismatch::none);
    EXPECT_EQ(tilted(Vec3::UnitX(), sign * 5.2), Mismatch::roll);
    EXPECT_EQ(tilted(Vec3::UnitY(), sign * 4.8), Mismatch::none);
    EXPECT_EQ(tilted(Vec3::UnitY(), sign * 5.2), Mismatch::pitch);
  }
  EXPECT_EQ(tilted(Vec3::UnitX(), 180), Mismatch::roll) << "upside down";
}

}  // namespace
}  // namespace backwash::track
