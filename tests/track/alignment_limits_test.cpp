// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/frame_alignment.hpp"
#include "tests/track/flown/frames.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace backwash::track {
namespace {

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

}  // namespace
}  // namespace backwash::track
