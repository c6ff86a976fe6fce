// SPDX-License-Identifier: BSD-3-Clause
// Row 53 of docs/faults.md: odometry that is not filled as the configuration says.
#include "services/backwashd/odometry_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

namespace backwash::daemon {
namespace {

using config::Twist;
using testing::HasSubstr;

/// A walk with the vehicle in the hands: it moves at `speed` along x of the world, its nose turned by `yaw`; `twist`
/// makes the message's twist from attitude and velocity. The last doubt of `seconds`.
using Filled = std::function<Vec3(const Eigen::Quaterniond& q, const Vec3& v_W)>;
std::string walk(OdometryCheck& check, const Filled& twist, double yaw, double speed = 0.4, double seconds = 5,
                 double rate = 50) {
  static double t = 100;
  std::string doubt;
  const Eigen::Quaterniond q(Eigen::AngleAxisd(yaw, Vec3::UnitZ()));
  const Vec3 v_W(speed, 0, 0);
  t += 10;
  for (int n = 0; n < static_cast<int>(seconds * rate); ++n) {
    const double at = n / rate;
    if (const auto now = check.look(static_cast<std::int64_t>((t + at) * 1e9), v_W * at, q, twist(q, v_W)))
      doubt = *now;
  }
  t += seconds;
  return doubt;
}

Vec3 in_body(const Eigen::Quaterniond& q, const Vec3& v_W) { return q.conjugate() * v_W; }
Vec3 in_world(const Eigen::Quaterniond&, const Vec3& v_W) { return v_W; }
Vec3 zeros(const Eigen::Quaterniond&, const Vec3&) { return Vec3::Zero(); }

TEST(OdometryCheck, DoubtsNothingThatIsFilledAsItWasTold) {
  for (const double yaw : {0.0, 1.57, -2.5}) {
    OdometryCheck body(Twist::body), world(Twist::world), none(Twist::none);
    EXPECT_EQ(walk(body, in_body, yaw), "");
    EXPECT_EQ(walk(world, in_world, yaw), "");
    EXPECT_EQ(walk(none, zeros, yaw), "");
  }
}

TEST(OdometryCheck, NamesAnEstimatorThatFillsNoTwist) {
  OdometryCheck check(Twist::body);
  EXPECT_EQ(walk(check, zeros, 0.3, 0.4, 0.7), "") << "0.28 m";
  EXPECT_THAT(walk(check, zeros, 0.3),
              testing::AllOf(HasSubstr("all zero while the pose moved 0.3 m"), HasSubstr("profile = \"fast_lio\"")));
  EXPECT_EQ(check.look(0, Vec3::Zero(), Eigen::Quaterniond::Identity(), Vec3::Zero()), "") << "it begins anew";
}

TEST(OdometryCheck, NamesATwistInTheOtherFrameAfterATurn) {
  OdometryCheck body(Twist::body), world(Twist::world);
  EXPECT_EQ(walk(body, in_world, 0.0), "") << "both frames are one here";
  EXPECT_THAT(walk(body, in_world, 1.57), HasSubstr("profile = \"vins_fusion\""));
  EXPECT_THAT(walk(world, in_body, 1.57), HasSubstr("profile = \"ros\""));
  EXPECT_EQ(walk(body, in_body, 1.57), "") << "the estimator was set right";
}

TEST(OdometryCheck, NamesATwistThatFitsNeitherFrame) {
  OdometryCheck check(Twist::body);
  const auto camera = [](const Eigen::Quaterniond& q, const Vec3& v_W) -> Vec3 {
    const Vec3 v_B = q.conjugate() * v_W;
    return {-v_B.y(), -v_B.z(), v_B.x()};  // z forward
  };
  EXPECT_THAT(walk(check, camera, 0.5), HasSubstr("contradict each other"));
}

TEST(OdometryCheck, StandingStillSaysNothing) {
  OdometryCheck check(Twist::body);
  EXPECT_EQ(walk(check, zeros, 0.5, 0, 20), "");
}

TEST(OdometryCheck, NamesARateAtWhichEachGapWouldBeAHold) {
  OdometryCheck slow(Twist::body), enough(Twist::body);
  EXPECT_THAT(walk(slow, in_body, 0, 0.4, 5, 10), HasSubstr("comes at less than 20 Hz"));
  EXPECT_EQ(walk(enough, in_body, 0, 0.4, 5, 21), "");
}

TEST(OdometryCheck, WhatIsNoNumberChangesNothing) {
  OdometryCheck check(Twist::body);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(check.look(1, {nan, 0, 0}, Eigen::Quaterniond::Identity(), Vec3::Zero()));
  EXPECT_EQ(walk(check, in_body, 1.57), "");
  const auto mostly_zeros = [n = 0, nan](const Eigen::Quaterniond&, const Vec3&) mutable -> Vec3 {
    return n++ % 10 == 9 ? Vec3(nan, 0, 0) : Vec3::Zero();
  };
  EXPECT_THAT(walk(check, mostly_zeros, 0.3), HasSubstr("all zero")) << "nor does it hide what is wrong beside it";
}

}  // namespace
}  // namespace backwash::daemon
