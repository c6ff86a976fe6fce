// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/in/localization.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>

#include "tests/daemon/lockstep/frames.hpp"

namespace backwash::daemon {
namespace {

using Quaternion = Eigen::Quaterniond;

const Vec3 kZero = Vec3::Zero();

dds::Odometry odometry(const std::string& frame, const Vec3& p, const Quaternion& q = Quaternion::Identity(),
                       const Vec3& v_B = Vec3::Zero(), double t = 1) {
  static const std::string child = "base_link";
  dds::Odometry m{};
  m.header.stamp = {static_cast<std::int32_t>(t), static_cast<std::uint32_t>(std::lround((t - std::floor(t)) * 1e9))};
  m.header.frame_id = dds::c_string(frame);
  m.child_frame_id = dds::c_string(child);
  m.pose.pose.position = {p.x(), p.y(), p.z()};
  m.pose.pose.orientation = {q.x(), q.y(), q.z(), q.w()};
  m.twist.twist.linear = {v_B.x(), v_B.y(), v_B.z()};
  return m;
}

dds::TransformStamped closure(const Quaternion& q, const Vec3& t, const std::string& frame = kMap,
                              const std::string& child = kOdom) {
  dds::TransformStamped m{};
  m.header.frame_id = dds::c_string(frame);
  m.child_frame_id = dds::c_string(child);
  m.transform.translation = {t.x(), t.y(), t.z()};
  m.transform.rotation = {q.x(), q.y(), q.z(), q.w()};
  return m;
}

Quaternion about_z(double yaw) { return Quaternion(Eigen::AngleAxisd(yaw, Vec3::UnitZ())); }

Localization localization() { return Localization(config::Daemon{}, 0.02); }

TEST(Localization, TakesOdometryOfTheMapAsItIs) {
  auto l = localization();
  const Quaternion q = about_z(0.5);
  const auto s = l.odometry(odometry(kMap, {1, 2, 3}, q, {1, 0, 0}), 7);
  ASSERT_TRUE(s) << s.error();
  EXPECT_EQ(s->state.p_W, Vec3(1, 2, 3));
  EXPECT_LT((s->state.v_W - q * Vec3(1, 0, 0)).norm(), 1e-12);
  EXPECT_EQ(s->closures, 0u);
  EXPECT_EQ(s->received_ns, 7);
}

TEST(Localization, RefusesFramesThatItDoesNotKnowAndNamesThem) {
  auto l = localization();
  const auto other = l.odometry(odometry(kUnknownFrame, kZero), 0);
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().find("'camera'"), std::string::npos);
  std::string hostile = "\x1b[2J\nbackwashd: all is well";
  hostile.resize(10'000, 'x');
  const auto cut = l.odometry(odometry(hostile, kZero), 0);
  ASSERT_FALSE(cut);
  EXPECT_LT(cut.error().size(), 400u);
  EXPECT_EQ(cut.error().find_first_of("\x1b\n"), std::string::npos) << cut.error();
  auto child = odometry(kMap, kZero);
  child.child_frame_id = dds::c_string(kUnknownFrame);
  EXPECT_FALSE(l.odometry(child, 0));
  child.child_frame_id = nullptr;
  EXPECT_FALSE(l.odometry(child, 0));
  const auto unplaced = l.odometry(odometry(kOdom, kZero), 0);
  ASSERT_FALSE(unplaced);
  EXPECT_NE(unplaced.error().find("before the first loop_closure"), std::string::npos) << unplaced.error();
  EXPECT_FALSE(l.loop_closure(closure(Quaternion::Identity(), kZero, kOdom, kMap)));
}

TEST(Localization, APositionTheVioItselfDoesNotTrustIsRefused) {
  auto l = localization();
  auto m = odometry(kMap, {1, 0, 0});
  const auto with = [&](double xx, double zz) {
    m.pose.covariance[0] = xx;
    m.pose.covariance[7] = std::abs(xx);
    m.pose.covariance[14] = zz;
    return l.odometry(m, 0).has_value();
  };
  EXPECT_TRUE(with(0.019 * 0.019, 0.019 * 0.019));
  EXPECT_FALSE(with(0.019 * 0.019, 0.021 * 0.021));
  EXPECT_FALSE(with(std::nan(""), 0));
  EXPECT_FALSE(with(-2, 0));
  EXPECT_TRUE(with(0, 0));  // not known
  EXPECT_FALSE(with(0, 100)) << "one axis that is known well, and one that is lost";
  EXPECT_TRUE(with(-1, 0));  // not known
}

TEST(Localization, ALoopClosureCarriesOdometryIntoTheMap) {
  auto l = localization();
  const Quaternion q = about_z(0.3), body = about_z(-0.2);
  ASSERT_TRUE(l.loop_closure(closure(q, {5, 6, 7})));
  const auto s = l.odometry(odometry(kOdom, {1, 2, 3}, body, {0, 1, 0}), 0);
  ASSERT_TRUE(s) << s.error();
  EXPECT_LT((s->state.p_W - (q * Vec3(1, 2, 3) + Vec3(5, 6, 7))).norm(), 1e-12);
  EXPECT_LT((s->state.v_W - q * body * Vec3(0, 1, 0)).norm(), 1e-12);
  EXPECT_LT(Quaternion(s->q[0], s->q[1], s->q[2], s->q[3]).angularDistance(q * body), 1e-9);
  EXPECT_EQ(s->closures, 1u);
  ASSERT_TRUE(l.loop_closure(closure(q, {5, 6, 7})));
  EXPECT_EQ(l.closures(), 1u) << "a repeated transform is no loop closure";
  ASSERT_TRUE(l.loop_closure(closure(q, {5.1, 6, 7})));
  EXPECT_EQ(l.closures(), 2u);
}

// At 20 Hz, as graph-based estimators send it: to and fro, and adrift.
TEST(Localization, StepsBelowTheEstimationErrorAreNoClosureUntilTheyAddUpToMore) {
  auto l = localization();
  ASSERT_TRUE(l.loop_closure(closure(about_z(0.3), {5, 6, 7})));
  const auto at = [&] { return l.odometry(odometry(kOdom, {40, 0, 1}, about_z(0)), 0)->state.p_W; };
  const Vec3 before = at();
  for (int n = 0; n < 100; ++n) {
    const double sign = n % 2 ? 1 : -1;
    ASSERT_TRUE(l.loop_closure(closure(about_z(0.3 + sign * 1e-4), {5 + sign * 0.004, 6, 7})));
    ASSERT_EQ(at(), before);
  }
  EXPECT_EQ(l.closures(), 1u);
  for (int n = 1; n <= 100; ++n) ASSERT_TRUE(l.loop_closure(closure(about_z(0.3), {5, 6 + 0.001 * n, 7})));
  EXPECT_EQ(l.closures(), 1u + 4u) << "one each 0.021 m";
  EXPECT_NEAR(at().y() - before.y(), 0.084, 1e-9);
  ASSERT_TRUE(l.loop_closure(closure(about_z(0.301), {5, 6.084, 7})));
  EXPECT_EQ(l.closures(), 6u) << "turned by 0.001 rad, 40 m away from where the frames began";
}

// Said once, and nothing where the vehicle was then.
TEST(Localization, ATurnIsAClosureWhereItHasComeToMatter) {
  auto l = localization();
  const auto at = [&](double x) { return l.odometry(odometry(kOdom, {x, 0, 1}, about_z(0)), 0)->state.p_W; };
  ASSERT_TRUE(l.loop_closure(closure(about_z(0), kZero)));
  at(0);
  ASSERT_TRUE(l.loop_closure(closure(about_z(0.015), kZero)));
  EXPECT_EQ(at(0.2).y(), 0);
  EXPECT_EQ(l.closures(), 1u);
  EXPECT_NEAR(at(10).y(), 10 * std::sin(0.015), 1e-9);
  EXPECT_EQ(l.closures(), 2u);
  auto before = localization();  // two before the first pose
  ASSERT_TRUE(before.loop_closure(closure(about_z(0), kZero)));
  ASSERT_TRUE(before.loop_closure(closure(about_z(0.015), kZero)));
  EXPECT_EQ(before.closures(), 2u);
}

TEST(Localization, ALoopClosureThatTiltsOrIsNoTransformIsRefused) {
  auto l = localization();
  EXPECT_FALSE(l.loop_closure(closure(Quaternion(Eigen::AngleAxisd(0.05, Vec3::UnitX())), kZero)));
  EXPECT_FALSE(l.loop_closure(closure(Quaternion(2, 0, 0, 0), kZero)));
  EXPECT_FALSE(l.loop_closure(closure(Quaternion::Identity(), {std::nan(""), 0, 0})));
  EXPECT_EQ(l.closures(), 0u);
}

/// A configuration with this estimator.
config::Daemon told(config::Twist twist, const Vec3& sensor_B = kZero, const Vec3& turned = kZero) {
  config::Daemon d;
  d.odometry.twist = twist;
  d.odometry.sensor_B = sensor_B;
  d.odometry.sensor_turned = turned;
  return d;
}

TEST(Localization, WhoseFramesTheyAreIsSaid) {
  auto l = localization();
  const std::string child = "body";
  auto m = odometry("camera_init", kZero);
  m.child_frame_id = dds::c_string(child);
  const auto refused = l.odometry(m, 0);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().find("FAST-LIO: odometry.profile = \"fast_lio\""), std::string::npos) << refused.error();
}

TEST(Localization, APoseAloneNamesNoChildThatAnEstimatorIsKnownBy) {
  config::Daemon config;
  config.odometry.message = config::PoseMessage::pose;
  config.odometry.child = "world";
  Localization l(config, 0.02);
  const std::string world = "world";
  auto m = odometry(world, kZero);
  m.child_frame_id = dds::c_string(world);
  const auto refused = l.odometry(m, 0);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().find("'world'"), std::string::npos) << refused.error();
  EXPECT_EQ(refused.error().find("looks like"), std::string::npos) << refused.error();
}

TEST(Localization, ATwistInTheFrameOfThePoseIsNotTurned) {
  Localization l(told(config::Twist::world), 0.02);
  ASSERT_TRUE(l.loop_closure(closure(about_z(0.3), {5, 6, 7})));
  const auto s = l.odometry(odometry(kOdom, {1, 2, 3}, about_z(1.5), {0, 1, 0}), 0);
  ASSERT_TRUE(s) << s.error();
  EXPECT_LT((s->state.v_W - about_z(0.3) * Vec3(0, 1, 0)).norm(), 1e-12) << "by the loop closure alone";
}

TEST(Localization, WithoutATwistTheVelocityComesFromThePoses) {
  Localization l(told(config::Twist::none), 0.02);
  std::string refused;
  for (int n = 0; n < 40; ++n) {
    const double t = 1 + 0.02 * n;
    const auto s = l.odometry(odometry(kMap, {0.4 * t, 0, 1}, about_z(1), kZero, t), 0);
    if (n < 10) {
      ASSERT_FALSE(s) << n;
      refused = s.error();
    } else {
      ASSERT_TRUE(s) << n;
      EXPECT_NEAR(s->state.v_W.x(), 0.4, 1e-6);
    }
  }
  EXPECT_NE(refused.find("velocity is not known yet"), std::string::npos) << refused;
}

// Of one vehicle in two frames, half a metre apart: differences between them are no velocity.
TEST(Localization, PosesOfTwoFramesInTurnHaveNoVelocity) {
  Localization l(told(config::Twist::none), 0.02);
  ASSERT_TRUE(l.loop_closure(closure(Quaternion::Identity(), {0.5, 0, 0})));
  for (int n = 0; n < 60; ++n) {
    const double t = 1 + 0.02 * n;
    const bool in_map = n % 2 == 0;
    EXPECT_FALSE(l.odometry(odometry(in_map ? kMap : kOdom, {in_map ? 0.5 : 0, 0, 1}, about_z(0), kZero, t), 0)) << n;
  }
}

// A lidar upside down, 0.1 m ahead of and 0.05 m above the body's origin, on a vehicle that turns at 2 rad/s.
TEST(Localization, ASensorBesideTheBodyTellsTheBodysPoseAndVelocity) {
  const Vec3 at(0.1, 0, 0.05), v_W(0.3, -0.2, 0.1), w_W(0, 0, 2), p(1, 2, 3);
  const Quaternion body = about_z(0.7), mounted(Eigen::AngleAxisd(M_PI, Vec3::UnitX())), sensor = body * mounted;
  const Vec3 lever = body * at, sensor_v = v_W + w_W.cross(lever);
  for (const config::Twist twist : {config::Twist::body, config::Twist::world}) {
    Localization l(told(twist, at, {M_PI, 0, 0}), 0.02);
    const bool in_body = twist == config::Twist::body;
    auto m = odometry(kMap, p + lever, sensor, in_body ? Vec3(sensor.conjugate() * sensor_v) : sensor_v);
    const Vec3 w = in_body ? Vec3(sensor.conjugate() * w_W) : w_W;
    m.twist.twist.angular = {w.x(), w.y(), w.z()};
    const auto s = l.odometry(m, 0);
    ASSERT_TRUE(s) << s.error();
    EXPECT_LT((s->state.p_W - p).norm(), 1e-9);
    EXPECT_LT((s->state.v_W - v_W).norm(), 1e-9);
    EXPECT_LT(Quaternion(s->q[0], s->q[1], s->q[2], s->q[3]).angularDistance(body), 1e-9);
  }
}

// docs/faults.md row 2: it takes no good sample's place.
TEST(Localization, RefusesABrokenPose) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  auto l = localization();
  ASSERT_TRUE(l.odometry(odometry(kMap, {0, 0, 1}, about_z(0), kZero, 1.0), 0));
  EXPECT_FALSE(l.odometry(odometry(kMap, {nan, 0, 1}, about_z(0), kZero, 1.05), 0));
  EXPECT_FALSE(l.odometry(odometry(kMap, {0, 0, 1}, about_z(0), {0, nan, 0}, 1.05), 0));
  EXPECT_FALSE(l.odometry(odometry(kMap, {0, 0, 1}, Quaternion(nan, 0, 0, 0), kZero, 1.05), 0));
  EXPECT_FALSE(l.odometry(odometry(kMap, {0, 0, 1}, Quaternion(2, 0, 0, 0), kZero, 1.05), 0));
  for (const double norm : {0.989, 1.011})
    EXPECT_FALSE(l.odometry(odometry(kMap, {0, 0, 1}, Quaternion(norm, 0, 0, 0), kZero, 1.05), 0)) << norm;
  EXPECT_TRUE(l.odometry(odometry(kMap, {0, 0, 1}, Quaternion(0.991, 0, 0, 0), kZero, 1.05), 0));
  EXPECT_TRUE(l.odometry(odometry(kMap, {0, 0, 1}, Quaternion(1.009, 0, 0, 0), kZero, 1.1), 0));
}

// docs/faults.md row 43: a float on the wire would be infinite, or too coarse.
TEST(Localization, RefusesWhatIsFiniteAndNowhere) {
  auto l = localization();
  EXPECT_TRUE(l.odometry(odometry(kMap, {9'999, 0, 1}, about_z(0), {0, 99, 0}, 1.0), 0));
  for (const double far : {1e308, 1e39, -1e39, 10'001.0})
    EXPECT_FALSE(l.odometry(odometry(kMap, {0, far, 1}, about_z(0), kZero, 1.1), 0)) << far;
  for (const double fast : {1e308, 1e39, -1e39, 101.0})
    EXPECT_FALSE(l.odometry(odometry(kMap, {0, 0, 1}, about_z(0), {0, 0, fast}, 1.1), 0)) << fast;
  for (const double far : {1e308, 1e39, -10'001.0})
    EXPECT_FALSE(l.loop_closure(closure(Quaternion::Identity(), {0, far, 0}))) << far;
  ASSERT_TRUE(l.loop_closure(closure(Quaternion::Identity(), {9'999, 0, 0})));
  EXPECT_FALSE(l.odometry(odometry(kOdom, {5, 0, 1}, about_z(0), kZero, 1.1), 0)) << "together they are beyond";
}

}  // namespace
}  // namespace backwash::daemon
