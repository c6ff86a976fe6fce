// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/autopilot_link.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <random>

#include "tests/bridge/emulated_controller.hpp"

namespace backwash::firmware_bridge::test {
namespace {

using mavlink::test::operator+;

TEST_F(LinkTest, SendsNothingBeforeTheVehicleIsHeard) {
  EXPECT_FALSE(link_.send_setpoint({}, kStart));
  EXPECT_FALSE(link_.send_heartbeat());
  EXPECT_FALSE(link_.send_arm(true));
  ASSERT_TRUE(link_.poll(kStart));
  ::usleep(20'000);
  EXPECT_TRUE(far_.read().empty());
}

TEST_F(LinkTest, SetsUpFromTheFlightControllersHeartbeatOnly) {
  say_and_poll(px4_heartbeat(false, 1), kStart, 255, 190);  // a ground station
  EXPECT_FALSE(link_.vehicle());
  mavlink::Heartbeat companion{.type = 18, .autopilot = 8};
  say_and_poll(companion, kStart, kVehicle, 1);
  EXPECT_FALSE(link_.vehicle());
  introduce_vehicle();
  EXPECT_EQ(link_.vehicle(), kVehicle);
  ASSERT_TRUE(link_.send_heartbeat());
  const auto m = heard_one<mavlink::Heartbeat>();
  EXPECT_EQ(m.type, 18);
  EXPECT_EQ(m.autopilot, 8);
  EXPECT_EQ(m.mavlink_version, 3);
}

TEST_F(LinkTest, IgnoresOtherSystemsAndComponents) {
  introduce_vehicle();
  say_and_poll(mavlink::LocalPositionNed{.time_boot_ms = 1, .x = 9}, kStart, kVehicle + 1, 1);
  say_and_poll(mavlink::LocalPositionNed{.time_boot_ms = 1, .x = 9}, kStart, kVehicle, 197);
  say_and_poll(px4_heartbeat(true, 6), kStart, kVehicle + 1, 1);
  EXPECT_FALSE(link_.telemetry().local_state.at(kStart));
  EXPECT_FALSE(link_.telemetry().status.at(kStart)->value.armed);
  say_and_poll(mavlink::LocalPositionNed{.time_boot_ms = 1, .x = 9});
  EXPECT_TRUE(link_.telemetry().local_state.at(kStart));
}

TEST_F(LinkTest, PutsThePositionVelocityAccelerationAndYawOfASetpointOnTheWireInNed) {
  introduce_vehicle();
  Setpoint s;
  s.p_W = {2, 1, 3};  // east, north, up
  s.v_W = {0.5, -0.25, 0.125};
  s.a_W = {-1, 4, 0.5};
  s.yaw = std::numbers::pi / 2;  // facing north
  ASSERT_TRUE(link_.send_setpoint(s, kStart));
  const auto m = heard_one<mavlink::SetPositionTargetLocalNed>();
  EXPECT_EQ(m.time_boot_ms, 1'000'000U);
  EXPECT_EQ((std::array{m.x, m.y, m.z}), (std::array{1.0F, 2.0F, -3.0F}));
  EXPECT_EQ((std::array{m.vx, m.vy, m.vz}), (std::array{-0.25F, 0.5F, -0.125F}));
  EXPECT_EQ((std::array{m.afx, m.afy, m.afz}), (std::array{4.0F, -1.0F, -0.5F}));
  EXPECT_NEAR(m.yaw, 0, 1e-7);
  EXPECT_EQ(m.type_mask, 2048);  // all but the yaw rate is used
  EXPECT_EQ(m.coordinate_frame, 1);
  EXPECT_EQ(m.target_system, kVehicle);
  EXPECT_EQ(m.target_component, 1);
}

TEST_F(LinkTest, NeverSendsAValueThatIsNotFinite) {
  introduce_vehicle();
  const double inf = std::numeric_limits<double>::infinity();
  for (const double bad :
       {static_cast<double>(kNan), inf, -inf, 1e39, -1e39}) {  // the last two are finite but as floats
    for (int i = 0; i < 10; ++i) {
      Setpoint s;
      (i < 3 ? s.p_W[i] : i < 6 ? s.v_W[i - 3] : i < 9 ? s.a_W[i - 6] : s.yaw) = bad;
      // Any finite angle has a heading.
      if (i == 9 && std::isfinite(bad)) continue;
      EXPECT_FALSE(link_.send_setpoint(s, kStart)) << i;
    }
    EXPECT_FALSE(link_.send_command(21, {0, 0, 0, 0, 0, 0, static_cast<float>(bad)}));
    const Vec3 wrong(0, bad, 0);
    const VioSample good{0, Vec3::Zero(), Eigen::Quaterniond::Identity(), Vec3::Zero(), {}, {}, {}, {}, 0};
    const std::function<void(VioSample&)> spoils[] = {
        [&](auto& v) { v.p_O = wrong; },
        [&](auto& v) { v.v_B = wrong; },
        [&](auto& v) { v.omega_B = wrong; },
        [&](auto& v) { v.q_OB.z() = bad; },
        [&](auto& v) { v.position_variance_O = wrong; },
        [&](auto& v) { v.attitude_variance_O = wrong; },
        [&](auto& v) { v.velocity_variance_B = wrong; },
    };
    for (const auto& spoil : spoils) {
      VioSample vio = good;
      spoil(vio);
      EXPECT_FALSE(link_.send_odometry(vio)) << &spoil - spoils;
    }
  }
  ::usleep(20'000);
  EXPECT_TRUE(far_.read().empty());
}

TEST_F(LinkTest, ForwardsVioAsOdometryOfOneFrameWithItsSetpoints) {
  introduce_vehicle();
  const Eigen::Quaterniond q(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()));
  const VioSample vio{
      77, {2, 1, 3}, q, {0.5, 0.25, -0.125}, Vec3(1, 2, 3), Vec3(0.25, 0.5, 1), Vec3(2, 4, 8), Vec3(16, 32, 64), 5};
  ASSERT_TRUE(link_.send_odometry(vio));
  const auto m = heard_one<mavlink::Odometry>();
  EXPECT_EQ(m.time_usec, 77U);
  EXPECT_EQ(m.frame_id, 20);        // MAV_FRAME_LOCAL_FRD
  EXPECT_EQ(m.child_frame_id, 12);  // MAV_FRAME_BODY_FRD
  EXPECT_EQ(m.reset_counter, 5);
  EXPECT_EQ((std::array{m.x, m.y, m.z}), (std::array{1.0F, 2.0F, -3.0F}));
  EXPECT_EQ((std::array{m.vx, m.vy, m.vz}), (std::array{0.5F, -0.25F, 0.125F}));
  EXPECT_EQ((std::array{m.rollspeed, m.pitchspeed, m.yawspeed}), (std::array{1.0F, -2.0F, -3.0F}));
  Mat3 R_NW;
  R_NW << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  const Mat3 expected = R_NW * q.toRotationMatrix() * Vec3(1, -1, -1).asDiagonal();
  const Eigen::Quaterniond sent(m.q[0], m.q[1], m.q[2], m.q[3]);
  EXPECT_LT((sent.toRotationMatrix() - expected).norm(), 1e-6);
  // Row-major upper triangle: variances at 0, 6, 11, 15, 18, 20; north is y, east is x.
  EXPECT_EQ((std::array{m.pose_covariance[0], m.pose_covariance[6], m.pose_covariance[11]}),
            (std::array{0.5F, 0.25F, 1.0F}));
  EXPECT_EQ((std::array{m.pose_covariance[15], m.pose_covariance[18], m.pose_covariance[20]}),
            (std::array{4.0F, 2.0F, 8.0F}));
  EXPECT_EQ((std::array{m.velocity_covariance[0], m.velocity_covariance[6], m.velocity_covariance[11]}),
            (std::array{16.0F, 32.0F, 64.0F}));
  EXPECT_EQ(m.pose_covariance[1], 0.0F);
}

TEST_F(LinkTest, MarksUnknownRatesAndAnUnknownCovarianceAsUnknown) {
  introduce_vehicle();
  ASSERT_TRUE(link_.send_odometry({1, Vec3::Zero(), Eigen::Quaterniond::Identity(), Vec3::Zero(), {}, {}, {}, {}, 0}));
  const auto m = heard_one<mavlink::Odometry>();
  EXPECT_TRUE(std::isnan(m.pose_covariance[0]));
  EXPECT_TRUE(std::isnan(m.velocity_covariance[0]));
  EXPECT_TRUE(std::isnan(m.rollspeed) && std::isnan(m.pitchspeed) && std::isnan(m.yawspeed));
}

TEST_F(LinkTest, AsksPx4ForOffboardArmingLandingAndRates) {
  introduce_vehicle();
  ASSERT_TRUE(link_.send_follow_setpoints());
  auto m = heard_one<mavlink::CommandLong>();
  EXPECT_EQ(m.command, 176);
  EXPECT_EQ((std::array{m.param1, m.param2, m.param3}), (std::array{1.0F, 6.0F, 0.0F}));
  EXPECT_EQ(m.target_system, kVehicle);
  ASSERT_TRUE(link_.send_arm(true));
  m = heard_one<mavlink::CommandLong>();
  EXPECT_EQ(m.command, 400);
  EXPECT_EQ(m.param1, 1.0F);
  EXPECT_EQ(m.param2, 0.0F) << "never by force";
  ASSERT_TRUE(link_.send_land());
  EXPECT_EQ(heard_one<mavlink::CommandLong>().command, 21);
  ASSERT_TRUE(link_.send_message_interval(mavlink::LocalPositionNed::kId, 50));
  m = heard_one<mavlink::CommandLong>();
  EXPECT_EQ(m.command, 511);
  EXPECT_EQ((std::array{m.param1, m.param2}), (std::array{32.0F, 20000.0F}));
  EXPECT_FALSE(link_.send_message_interval(32, 0));
}

TEST_F(LinkTest, AsksArduPilotForGuided) {
  say_and_poll(mavlink::Heartbeat{.custom_mode = 0, .type = 2, .autopilot = 3, .base_mode = 1});
  ASSERT_TRUE(link_.send_follow_setpoints());
  const auto m = heard_one<mavlink::CommandLong>();
  EXPECT_EQ(m.command, 176);
  EXPECT_EQ((std::array{m.param1, m.param2}), (std::array{1.0F, 4.0F}));
}

TEST_F(LinkTest, HearsAnswersThatAreMeantForIt) {
  introduce_vehicle();
  say_and_poll(mavlink::CommandAck{.command = 400, .result = 4, .target_system = 255, .target_component = 190});
  EXPECT_FALSE(link_.telemetry().result_of(kCommandArm)) << "an answer to the ground station";
  say_and_poll(mavlink::CommandAck{.command = 400, .result = 1, .target_system = kVehicle, .target_component = 191});
  EXPECT_EQ(link_.telemetry().result_of(kCommandArm)->value.result, 1);
  say_and_poll(mavlink::CommandAck{.command = 400, .result = 0});  // older senders name no target
  EXPECT_EQ(link_.telemetry().result_of(kCommandArm)->value.result, 0);
}

TEST_F(LinkTest, AnswersTimesyncAndMeasuresTheOffset) {
  introduce_vehicle();
  say_and_poll(mavlink::Timesync{.tc1 = 0, .ts1 = 123});
  const auto answer = heard_one<mavlink::Timesync>();
  EXPECT_EQ(answer.ts1, 123);
  EXPECT_EQ(answer.tc1, 1'000'000'000'000);
  ASSERT_TRUE(link_.send_timesync(kStart));
  const auto question = heard_one<mavlink::Timesync>();
  EXPECT_EQ(question.tc1, 0);
  EXPECT_EQ(question.ts1, 1'000'000'000'000);
  say_and_poll(mavlink::Timesync{.tc1 = 5'000'000, .ts1 = question.ts1 - 1}, kStart + 4ms);
  EXPECT_FALSE(link_.clock(kStart)) << "an answer to somebody else's question";
  for (const std::int64_t absurd :
       {std::numeric_limits<std::int64_t>::min(), std::int64_t{-1}, std::numeric_limits<std::int64_t>::max()}) {
    say_and_poll(mavlink::Timesync{.tc1 = absurd, .ts1 = question.ts1}, kStart + 4ms);
    EXPECT_FALSE(link_.clock(kStart)) << "a time that no clock shows";
  }
  say_and_poll(mavlink::Timesync{.tc1 = 5'000'000, .ts1 = question.ts1}, kStart + 4ms);
  ASSERT_TRUE(link_.clock(kStart));
  EXPECT_EQ(link_.clock(kStart)->value.round_trip_ns, 4'000'000);
  EXPECT_EQ(link_.clock(kStart)->value.offset_ns, 5'000'000 - (1'000'000'000'000 + 2'000'000));
}

TEST_F(LinkTest, SendsATextOfAtMostFiftyCharacters) {
  introduce_vehicle();
  ASSERT_TRUE(link_.send_statustext(4, std::string(60, 'y')));
  const auto m = heard_one<mavlink::Statustext>();
  EXPECT_EQ(std::string(m.text.begin(), m.text.end()), std::string(50, 'y'));
  EXPECT_EQ(m.severity, 4);
}

TEST(AutopilotLinkOverUdp, TalksToTheFirstPeerThatIsAFlightController) {
  auto ours = UdpPort::open({"127.0.0.1", 0}, std::nullopt);
  ASSERT_TRUE(ours);
  auto theirs = UdpPort::open({"127.0.0.1", 0}, UdpPort::Endpoint{"127.0.0.1", ours->local_port()});
  ASSERT_TRUE(theirs);
  AutopilotLink link(std::move(*ours), std::nullopt, kStart);
  ASSERT_TRUE(theirs->write(mavlink::encode_frame({kVehicle, 1, 0}, px4_heartbeat(true, 6)).view()));
  for (int i = 0; i < 1000 && !link.vehicle(); ++i) {
    ASSERT_TRUE(link.poll(kStart));
    ::usleep(1000);
  }
  ASSERT_TRUE(link.telemetry().status.at(kStart));
  EXPECT_TRUE(link.telemetry().status.at(kStart)->value.armed &&
              link.telemetry().status.at(kStart)->value.follows_setpoints);
  ASSERT_TRUE(link.send_setpoint({}, kStart));
  std::array<std::uint8_t, 512> bytes;
  std::size_t size = 0;
  for (int i = 0; i < 1000 && size == 0; ++i) {
    size = theirs->read(bytes).value();
    ::usleep(1000);
  }
  const auto frames = mavlink::test::parse(std::span(bytes).first(size));
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].frame.id, mavlink::SetPositionTargetLocalNed::kId);
}

}  // namespace
}  // namespace backwash::firmware_bridge::test
