// SPDX-License-Identifier: BSD-3-Clause
// Row 53 of docs/faults.md: odometry that is not filled as the configuration says.
#include "services/backwashd/in/odometry_check.hpp"

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
  EXPECT_THAT(walk(slow, in_body, 0, 0.4, 5, 10),
              testing::AllOf(HasSubstr("comes at 10.0 Hz"), HasSubstr("odometry.rate_least = 20:")));
  EXPECT_EQ(walk(enough, in_body, 0, 0.4, 5, 21), "");
}

TEST(OdometryCheck, TakesTheRateThatWasStated) {
  OdometryCheck ten(Twist::body, {9, 0}), fast(Twist::body, {100, 0});
  EXPECT_EQ(walk(ten, in_body, 0, 0.4, 5, 9.2), "");
  EXPECT_THAT(walk(ten, in_body, 0, 0.4, 5, 8.7), HasSubstr("odometry.rate_least = 9:"));
  EXPECT_THAT(walk(fast, in_body, 0, 0.4, 5, 60), HasSubstr("odometry.rate_least = 100:"));
}

/// The last doubt of 2 s of messages of a vehicle that stands, each `late(n)` seconds after its stamp.
std::string stands(OdometryCheck& check, const std::function<std::optional<double>(int)>& late, double from) {
  std::string doubt;
  for (int n = 0; n < 100; ++n)
    if (const auto now = check.look(static_cast<std::int64_t>((from + n * 0.02) * 1e9), Vec3::Zero(),
                                    Eigen::Quaterniond::Identity(), Vec3::Zero(), late(n)))
      doubt = *now;
  return doubt;
}

TEST(OdometryCheck, NamesALatencyThatWasNotStated) {
  const auto always = [](double s) { return [=](int) { return std::optional(s); }; };
  OdometryCheck unstated(Twist::body), stated(Twist::body, {20, 0.12}), hopeless(Twist::body);
  EXPECT_EQ(stands(unstated, always(0.025), 10), "");
  EXPECT_THAT(
      stands(unstated, always(0.12), 20),
      testing::AllOf(HasSubstr("120 ms after its stamp"), HasSubstr("odometry.latency says 0: set it to 0.120")));
  EXPECT_EQ(stands(stated, always(0.12), 30), "");
  EXPECT_EQ(stands(
                stated, [](int n) { return n % 4 ? 0.16 : 0.12; }, 40),
            "")
      << "the least of them is the latency";
  EXPECT_THAT(stands(stated, always(0.001), 50), HasSubstr("set it to 0.001")) << "too old a set would be asked";
  EXPECT_EQ(stands(
                stated, [](int) { return std::nullopt; }, 60),
            "")
      << "of another clock nothing is known";
  EXPECT_THAT(stands(hopeless, always(0.35), 70), HasSubstr("too late to fly by"));
}

TEST(OdometryCheck, TellsACauseOnceWhateverItsValueDoes) {
  OdometryCheck check(Twist::body);
  int told = 0;
  for (int n = 0; n < 400; ++n)
    told += check
                .look(static_cast<std::int64_t>((5 + 0.1 * n + 0.0001 * n * n) * 1e9), Vec3::Zero(),
                      Eigen::Quaterniond::Identity(), Vec3::Zero(), 0.1 + 0.001 * (n % 7))
                .has_value();
  EXPECT_LE(told, 3) << "nothing; the latency or the rate; then the other";
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
