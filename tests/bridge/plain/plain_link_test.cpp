// SPDX-License-Identifier: BSD-3-Clause
// A controller behind the plain serial link, as the link sees it.
#include "firmware_bridge/plain/plain.h"
#include "tests/bridge/emulated_controller.hpp"
#include "tests/bridge/plain/plain_frames.hpp"

namespace backwash::firmware_bridge::test {
namespace {

using mavlink::test::operator+;

/// The link on a plain line, whose other end the test holds.
class PlainLinkTest : public testing::Test {
 protected:
  /// Until the link has read so many MAVLink frames, or has counted so many bad ones.
  void poll_until(std::uint64_t frames, std::uint64_t bad = 0) {
    for (int i = 0; i < 1000 && (link_.received().frames < frames || link_.received().bad_crc < bad); ++i) {
      ASSERT_TRUE(link_.poll(kStart));
      ::usleep(1000);
    }
    ASSERT_GE(link_.received().frames, frames);
    ASSERT_GE(link_.received().bad_crc, bad);
  }
  void say(const plain_state_t& s) { far_.write(wire(s)); }
  /// The frames that the controller gets.
  std::vector<plain_event_t> heard() { return events(receiver_, far_.await()); }
  plain_command_t command() {
    EXPECT_EQ(heard(), std::vector{PLAIN_COMMAND});
    plain_command_t c{};
    plain_read_command(&receiver_, &c);
    return c;
  }
  static Port open(const std::string& path) { return PlainPort(SerialPort::open(path, 57600).value(), kVehicle); }

  PseudoTerminal far_;
  AutopilotLink link_{open(far_.path()), kVehicle, kStart};
  plain_receiver_t receiver_{};
};

TEST_F(PlainLinkTest, AControllersStateIsTelemetry) {
  say(flying());
  poll_until(6);
  const auto& t = link_.telemetry();
  EXPECT_EQ(link_.vehicle(), kVehicle);
  EXPECT_EQ(t.status.at(kStart)->value.autopilot, &kPlain);
  EXPECT_TRUE(t.status.at(kStart)->value.armed && t.status.at(kStart)->value.follows_setpoints);
  EXPECT_EQ(t.status.at(kStart)->value.system_status, 4);
  EXPECT_EQ(t.local_state.at(kStart)->value.p_W, Vec3(1, -2, 3));
  EXPECT_EQ(t.local_state.at(kStart)->value.v_W, Vec3(0.5, 0.25, -0.125));
  EXPECT_LT((t.attitude.at(kStart)->value.q_LB * Vec3::UnitX() - Vec3::UnitY()).norm(), 1e-6);
  EXPECT_LT((t.attitude.at(kStart)->value.omega_B - Vec3(0.1, 0.2, -0.3)).norm(), 1e-6);
  EXPECT_EQ(t.landed_state.at(kStart)->value, LandedState::in_air);
  EXPECT_EQ(t.reset_counter.at(kStart)->value, 3);
  EXPECT_NEAR(*t.battery.at(kStart)->value.voltage, 15.6, 1e-9);
  EXPECT_NEAR(*t.battery.at(kStart)->value.remaining, 0.87, 1e-9);
  EXPECT_FALSE(t.battery.at(kStart)->value.current);
  auto s = flying();
  s.sequence = 2;
  s.failsafe = s.on_ground = true;
  s.following = false;
  say(s);
  poll_until(12);
  EXPECT_FALSE(t.status.at(kStart)->value.follows_setpoints);
  EXPECT_EQ(t.status.at(kStart)->value.system_status, 5);
  EXPECT_EQ(t.landed_state.at(kStart)->value, LandedState::on_ground);
}

TEST_F(PlainLinkTest, AControllerThatKnowsNoPoseYetIsHeardAndSentPoses) {
  auto s = flying();
  s.pose_known = false;
  std::ranges::fill(s.attitude, 0.F);
  say(s);
  poll_until(3);  // HEARTBEAT, EXTENDED_SYS_STATE, BATTERY_STATUS
  const auto& t = link_.telemetry();
  EXPECT_EQ(link_.vehicle(), kVehicle);
  EXPECT_TRUE(t.status.at(kStart) && t.landed_state.at(kStart) && t.battery.at(kStart));
  EXPECT_FALSE(t.local_state.at(kStart) || t.attitude.at(kStart) || t.reset_counter.at(kStart));
  EXPECT_EQ(t.broken, 0U);
  VioSample vio{};
  vio.p_O = vio.v_B = Vec3::Zero();
  vio.q_OB = Eigen::Quaterniond::Identity();
  ASSERT_TRUE(link_.send_odometry(vio));
  EXPECT_EQ(heard(), std::vector{PLAIN_POSE});
}

TEST_F(PlainLinkTest, ARepeatedStateIsNoSignOfLife) {
  say(flying());
  say(flying());
  auto other = flying();
  other.sequence = 2;
  other.battery_percent = 50;
  say(other);
  poll_until(12);
  EXPECT_EQ(link_.received().frames, 12U);
  EXPECT_NEAR(*link_.telemetry().battery.at(kStart)->value.remaining, 0.5, 1e-9);
}

TEST_F(PlainLinkTest, SetpointsAndPosesArriveAsTheyWereGiven) {
  EXPECT_FALSE(link_.send_setpoint({}, kStart)) << "the controller was not heard yet";
  say(flying());
  poll_until(6);
  Setpoint given;
  given.p_W = {1.5, -2.5, 3.5};
  given.v_W = {0.1, 0.2, 0.3};
  given.a_W = {-1, 2, -3};
  given.yaw = -2;
  ASSERT_TRUE(link_.send_setpoint(given, kStart));
  const auto c = command();
  EXPECT_TRUE(c.has_setpoint);
  EXPECT_EQ(c.request, PLAIN_REQUEST_NONE);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(c.position[i], static_cast<float>(given.p_W(i)));
    EXPECT_EQ(c.velocity[i], static_cast<float>(given.v_W(i)));
    EXPECT_EQ(c.acceleration[i], static_cast<float>(given.a_W(i)));
  }
  EXPECT_NEAR(c.yaw, -2, 1e-6);

  VioSample vio{};
  const auto taken = std::chrono::steady_clock::now().time_since_epoch() - 50ms;
  vio.time_us = static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(taken).count());
  vio.p_O = {4, 5, 6};
  vio.q_OB = Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Vec3::UnitZ()));
  vio.v_B = {1, 2, 3};
  vio.reset_counter = 9;
  ASSERT_TRUE(link_.send_odometry(vio));
  ASSERT_EQ(heard(), std::vector{PLAIN_POSE});
  plain_pose_t p;
  plain_read_pose(&receiver_, &p);
  EXPECT_EQ(std::tuple(p.position[0], p.position[1], p.position[2]), std::tuple(4.F, 5.F, 6.F));
  EXPECT_EQ(std::tuple(p.velocity_b[0], p.velocity_b[1], p.velocity_b[2]), std::tuple(1.F, 2.F, 3.F));
  EXPECT_NEAR(p.attitude[0], std::cos(0.25), 1e-6);
  EXPECT_NEAR(p.attitude[3], std::sin(0.25), 1e-6);
  EXPECT_EQ(p.reset_counter, 9);
  EXPECT_GE(p.age_tenths_ms, 500);
  EXPECT_EQ(p.sequence, c.sequence + 1);
}

TEST_F(PlainLinkTest, RequestsAreAskedOnceAndTheirAnswersAreResults) {
  auto s = flying();
  say(s);
  poll_until(6);
  const std::tuple<bool (*)(AutopilotLink&), std::uint8_t, std::uint16_t, std::uint8_t> requests[] = {
      {[](AutopilotLink& l) { return l.send_follow_setpoints(); }, PLAIN_REQUEST_FOLLOW, kCommandSetMode, 1},
      {[](AutopilotLink& l) { return l.send_arm(true); }, PLAIN_REQUEST_ARM, kCommandArm, 2},
      {[](AutopilotLink& l) { return l.send_arm(false); }, PLAIN_REQUEST_DISARM, kCommandArm, 1},
      {[](AutopilotLink& l) { return l.send_land(); }, PLAIN_REQUEST_LAND, kCommandLand, 2}};
  std::uint64_t frames = 6;
  for (const auto& [send, request, number, answer] : requests) {
    ASSERT_TRUE(send(link_));
    const auto c = command();
    EXPECT_EQ(c.request, request);
    EXPECT_FALSE(c.has_setpoint);
    ++s.sequence;
    s.answered = c.sequence;
    s.answer = answer;
    say(s);
    poll_until(frames += 7);
    const auto result = link_.telemetry().result_of(number);
    ASSERT_TRUE(result);
    EXPECT_EQ(result->value.result, answer == PLAIN_ANSWER_DONE ? 0 : 2);
    ++s.sequence;
    say(s);
    poll_until(frames += 6);
    EXPECT_EQ(link_.received().frames, frames) << "an answer is told once";
  }
}

TEST_F(PlainLinkTest, WhatThePlainLinkHasNoFrameForIsNotSent) {
  say(flying());
  poll_until(6);
  EXPECT_TRUE(link_.send_timesync(kStart) && link_.send_statustext(5, "x") && link_.send_message_interval(32, 50));
  EXPECT_TRUE(link_.send_heartbeat());
  const auto c = command();
  EXPECT_FALSE(c.has_setpoint) << "the heartbeat alone";
  EXPECT_EQ(c.request, PLAIN_REQUEST_NONE);
}

TEST_F(PlainLinkTest, RefusedFramesCountAndNameAWrongBaudRate) {
  EXPECT_EQ(link_.fault(kStart + 2s), LinkFault::nothing_received);
  Bytes bad = wire(flying());
  bad[20] ^= 1;
  far_.write(bad);
  poll_until(0, 1);
  EXPECT_EQ(link_.fault(kStart + 2s), LinkFault::no_valid_frame);
  far_.write(Bytes(1000, 0x55));  // not one delimiter
  poll_until(0, 3);
  EXPECT_FALSE(link_.vehicle());
  far_.write(Bytes{0} + wire(flying()));
  poll_until(6);
  EXPECT_EQ(link_.vehicle(), kVehicle);
}

TEST_F(PlainLinkTest, AFullLineShowsAsMissedSetpointsAndFramesStayWhole) {
  say(flying());
  poll_until(6);
  int sent = 0;
  for (; sent < 2000 && link_.fault(kStart) != LinkFault::transmit_stalled; ++sent)
    ASSERT_TRUE(link_.send_setpoint({}, kStart));
  EXPECT_EQ(link_.fault(kStart), LinkFault::transmit_stalled);
  std::vector<plain_event_t> all;
  for (int i = 0; i < 100; ++i) {
    const auto some = events(receiver_, far_.read());
    all.insert(all.end(), some.begin(), some.end());
    ASSERT_TRUE(link_.poll(kStart));
    ::usleep(500);
  }
  EXPECT_EQ(std::ranges::count(all, PLAIN_REFUSED), 0);
  EXPECT_GT(all.size(), 50U);
  EXPECT_FALSE(link_.fault(kStart));
}

TEST_F(PlainLinkTest, AHangUpIsALostPort) {
  say(flying());
  poll_until(6);
  far_.hang_up();
  EXPECT_FALSE(link_.poll(kStart));
  EXPECT_EQ(link_.fault(kStart), LinkFault::port_lost);
}

// What the plain link makes up of a controller's state: nothing that it does not know, no answer to another request.

/// The link on a plain line, whose other end the test holds.
class PlainAnswers : public testing::Test {
 protected:
  /// Says a state and polls until the link has taken its frames; the next state has the next number.
  void say(plain_state_t s) {
    s.sequence = ++sequence_;
    Bytes wire(PLAIN_STATE_SIZE);
    plain_write_state(&s, wire.data());
    const std::uint64_t before = link_.received().frames;
    far_.write(wire);
    for (int i = 0; i < 2000 && link_.received().frames == before; ++i) {
      ASSERT_TRUE(link_.poll(kStart));
      ::usleep(500);
    }
    ASSERT_TRUE(link_.poll(kStart));
    ASSERT_GT(link_.received().frames, before);
  }
  /// Number of the last request that the controller got.
  std::uint16_t asked() {
    plain_receiver_t receiver{};
    plain_command_t c{};
    for (const auto byte : far_.await())
      if (plain_receive(&receiver, byte) == PLAIN_COMMAND) plain_read_command(&receiver, &c);
    return c.sequence;
  }
  static Port open(const std::string& path) { return PlainPort(SerialPort::open(path, 57600).value(), kVehicle); }

  PseudoTerminal far_;
  AutopilotLink link_{open(far_.path()), kVehicle, kStart};
  std::uint16_t sequence_ = 0;
};

TEST_F(PlainAnswers, AControllerThatDoesNotKnowTheGroundIsNeitherOnItNorInTheAir) {
  plain_state_t s{};
  say(s);
  EXPECT_EQ(link_.vehicle(), kVehicle);
  EXPECT_FALSE(link_.telemetry().landed_state.at(kStart));
  s.ground_known = true;
  say(s);
  ASSERT_TRUE(link_.telemetry().landed_state.at(kStart));
  EXPECT_EQ(link_.telemetry().landed_state.at(kStart)->value, LandedState::in_air);
}

TEST_F(PlainAnswers, AnAnswerToAnEarlierRequestIsNoneToThisOne) {
  constexpr std::uint16_t kArm = 400;
  plain_state_t s{};
  say(s);
  ASSERT_TRUE(link_.send_arm(true));
  const std::uint16_t first = asked();
  ASSERT_TRUE(link_.send_arm(false));
  const std::uint16_t second = asked();
  ASSERT_NE(first, second);
  s.answered = first;
  s.answer = PLAIN_ANSWER_DONE;
  say(s);
  EXPECT_FALSE(link_.telemetry().result_of(kArm));
  s.answered = second;
  say(s);
  EXPECT_TRUE(link_.telemetry().result_of(kArm));
}

}  // namespace
}  // namespace backwash::firmware_bridge::test
