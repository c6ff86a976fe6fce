// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/line_budget.hpp"

#include <gtest/gtest.h>

#include <deque>

#include "firmware_bridge/outgoing.hpp"
#include "firmware_bridge/port/transmit_queue.hpp"
#include "tests/bridge/emulated_controller.hpp"

namespace backwash::firmware_bridge::test {
namespace {

using Kind = TransmitQueue::Kind;

constexpr std::size_t kSetpoint = 65, kOdometry = 245, kTimesync = 28;  // bytes on the line, as MAVLink has them

/// A line of so many bytes a second, byte by byte: when each frame that it was given has left it.
struct TrueLine {
  double rate;
  double free_s = 0;
  double give(std::size_t bytes, double now_s) {
    free_s = std::max(free_s, now_s) + static_cast<double>(bytes) / rate;
    return free_s;
  }
};

struct Carried {
  std::vector<int> odometry_ticks;
  double longest_wait_s = 0;  ///< of a set-point, until its first byte
  double backlog_s = 0;       ///< at the end
};

/// Set-points at 50 Hz, TIMESYNC at 12, and ODOMETRY in every tick that has room, on a line of this rate.
Carried drive(const LineRate& believed, double true_rate, int ticks) {
  LineBudget budget(believed);
  TrueLine line{true_rate};
  Carried result;
  for (int n = 0; n < ticks; ++n) {
    const double now_s = n * 0.02;
    const Time now = kStart + std::chrono::milliseconds(20 * n);
    const auto give = [&](std::size_t bytes, bool odometry) {
      budget.give(bytes, odometry, now);
      return line.give(bytes, now_s);
    };
    const double gone = give(kSetpoint, false);
    result.longest_wait_s = std::max(result.longest_wait_s, gone - now_s - kSetpoint / true_rate);
    if (n % 4 == 0) give(kTimesync, false);
    if (!budget.carries_odometry(now)) continue;
    give(kOdometry, true);
    result.odometry_ticks.push_back(n);
  }
  result.backlog_s = line.free_s - ticks * 0.02;
  return result;
}

int longest_gap(const std::vector<int>& ticks) {
  int gap = 0;
  for (std::size_t i = 1; i < ticks.size(); ++i) gap = std::max(gap, ticks[i] - ticks[i - 1]);
  return gap;
}

TEST(LineBudget, AFramesBytesAreThoseOfTheEncoder) {
  const VioSample vio{1, Vec3::Ones(), Eigen::Quaterniond::Identity(), Vec3::Ones(), Vec3::Ones(), {}, {}, {}, 1};
  EXPECT_EQ(mavlink::encode_frame({1, 191, 0}, setpoint_message({}, 1, {1, 1})).length, kSetpoint);
  EXPECT_LE(mavlink::encode_frame({1, 191, 0}, odometry_message(vio)).length, kOdometry);
}

TEST(LineBudget, ALineWithoutARateCarriesEverything) {
  EXPECT_EQ(drive(LineRate{}, 1e9, 50).odometry_ticks.size(), 50U);
}

TEST(LineBudget, ALineOf57600BaudCarriesWhatAnEstimatorNeedsAndNoSetpointWaitsForTwoFramesOfOdometry) {
  const Carried c = drive(serial_line(57'600, kSerialShare, false), 5760, 5000);
  EXPECT_LE(longest_gap(c.odometry_ticks), kLongestOdometryTicks);
  EXPECT_LE(c.longest_wait_s, (kOdometry + kSetpoint + kTimesync) / 5760.0);
  EXPECT_LT(c.backlog_s, kOdometry / 5760.0 + 0.02);
}

TEST(LineBudget, OneThatIsSlowerThanItSaysByHalfTheToleranceOfEachEndStillRunsDry) {
  const Carried c = drive(serial_line(57'600, kSerialShare, false), 5760 * 0.975, 50'000);
  EXPECT_LT(c.backlog_s, kOdometry / 5760.0 + 0.02);
}

TEST(LineBudget, SendsTheNextOdometryInTheFirstTickInWhichTheLineIsFree) {
  const LineRate line = serial_line(57'600, 1, false);
  TrueLine same{5760};
  LineBudget budget(line);
  for (int n = 0; n < 500; ++n) {
    const Time now = kStart + std::chrono::milliseconds(20 * n);
    const bool dry = same.free_s <= n * 0.02;
    EXPECT_EQ(budget.carries_odometry(now), dry) << n;
    if (dry) {
      budget.give(kOdometry, true, now);
      same.give(kOdometry, n * 0.02);
    }
    budget.give(kSetpoint, false, now);
    same.give(kSetpoint, n * 0.02);
  }
}

TEST(LineBudget, TheLeastRateIsThatOfALineOnWhichTheGapIsJustGoodEnough) {
  const double least = least_rate(0, false);
  EXPECT_NEAR(least, 50 * kSetpoint + kOdometry / 0.16 + 17 * kTimesync,
              35);  // TIMESYNC to one target has 2 bytes more
  EXPECT_LE(longest_gap(drive({least}, least, 5000).odometry_ticks), kLongestOdometryTicks);
  EXPECT_GT(longest_gap(drive({0.9 * least}, 0.9 * least, 5000).odometry_ticks), kLongestOdometryTicks);
}

TEST(LineBudget, SignaturesAndThePlainLinkCountWithTheirOwnBytes) {
  EXPECT_NEAR(least_rate(0, true) - least_rate(0, false), 13 * (50 + 1 / 0.16 + 17), 1e-6);
  EXPECT_NEAR(least_rate(58, false), 58 * (50 + 1 / 0.16 + 17), 1e-6);
  LineBudget plain(serial_line(57'600, 1, true));
  plain.give(kOdometry, true, kStart);
  constexpr auto kTakes = std::chrono::nanoseconds(1'000'000'000LL * 58 / 5760);
  EXPECT_FALSE(plain.carries_odometry(kStart + kTakes - std::chrono::microseconds(1)));
  EXPECT_TRUE(plain.carries_odometry(kStart + kTakes + std::chrono::microseconds(1)));
}

TEST(LineBudget, WhatIsForgottenNoLongerOccupiesTheLine) {
  LineBudget budget(serial_line(9600, 1, false));
  budget.give(kOdometry, true, kStart);
  ASSERT_FALSE(budget.carries_odometry(kStart));
  budget.forget();
  EXPECT_TRUE(budget.carries_odometry(kStart));
  budget.give(kOdometry, true, kStart);
  EXPECT_FALSE(budget.carries_odometry(kStart)) << "the rate is kept";
}

mavlink::EncodedFrame frame_of(std::uint8_t byte) {
  mavlink::EncodedFrame f;
  f.length = 10;
  f.bytes.fill(byte);
  return f;
}

TEST(TransmitQueueOdometry, ASetpointTakesThePlaceOfOdometryThatWaits) {
  TransmitQueue queue;
  queue.push(frame_of(1), Kind::kOdometry);
  queue.push(frame_of(2), Kind::kOther);
  queue.push(frame_of(3), Kind::kOdometry);
  queue.push(frame_of(4), Kind::kSetpoint);
  std::vector<std::uint8_t> order;
  ASSERT_TRUE(queue.flush([&](std::span<const std::uint8_t> b) -> tl::expected<std::size_t, PortError> {
    order.push_back(b[0]);
    return b.size();
  }));
  EXPECT_EQ(order, (std::vector<std::uint8_t>{2, 4}));
  EXPECT_EQ(queue.dropped(), 2U);
}

TEST(TransmitQueueOdometry, OdometryThatHasBegunIsFinishedBeforeTheSetpointAndANewOneTakesThePlaceOfTheOldAlone) {
  TransmitQueue queue;
  queue.push(frame_of(1), Kind::kOdometry);
  ASSERT_TRUE(queue.flush([](auto) -> tl::expected<std::size_t, PortError> { return 4U; }));
  queue.push(frame_of(2), Kind::kSetpoint);
  queue.push(frame_of(3), Kind::kOdometry);
  queue.push(frame_of(4), Kind::kOdometry);
  std::vector<std::uint8_t> order;
  ASSERT_TRUE(queue.flush([&](std::span<const std::uint8_t> b) -> tl::expected<std::size_t, PortError> {
    order.push_back(b[0]);
    return b.size();
  }));
  EXPECT_EQ(order, (std::vector<std::uint8_t>{1, 2, 4}));
  EXPECT_EQ(queue.missed_setpoints(), 0);
}

TEST_F(LinkTest, ThinsOdometryAloneAndCountsIt) {
  introduce_vehicle();
  link_.pace(serial_line(57'600, 1, false));
  const VioSample vio{1, Vec3::Ones(), Eigen::Quaterniond::Identity(), Vec3::Ones(), {}, {}, {}, {}, 0};
  const auto poll_at = [&](int ms) { ASSERT_TRUE(link_.poll(kStart + std::chrono::milliseconds(ms))); };
  poll_at(20);
  EXPECT_TRUE(link_.send_odometry(vio));
  EXPECT_FALSE(link_.send_odometry(vio));
  EXPECT_TRUE(link_.send_setpoint({}, kStart) && link_.send_heartbeat());
  poll_at(40);
  EXPECT_FALSE(link_.send_odometry(vio)) << "42 ms for ODOMETRY and 15 for what followed it";
  EXPECT_EQ(link_.thinned(), 2U);
  poll_at(80);
  EXPECT_TRUE(link_.send_odometry(vio));
  link_.discard_unsent();
  EXPECT_TRUE(link_.send_odometry(vio)) << "nothing is under way";
}

TEST_F(LinkTest, TellsALineThatTakesNothingThoughNoSetpointWaits) {
  introduce_vehicle();
  int ms = 0, blocked_at = -1;
  for (; ms < 5000 && link_.fault(kStart + std::chrono::milliseconds(ms)) != LinkFault::kTransmitStalled; ms += 20) {
    const Time now = kStart + std::chrono::milliseconds(ms);
    say_and_poll(px4_heartbeat(false, 1), now);  // it speaks, and does not listen
    for (int n = 0; n < 20; ++n) link_.send_statustext(6, "nobody reads this");
    if (blocked_at < 0 && link_.transmit().waiting() > 0) blocked_at = ms;
  }
  ASSERT_GE(blocked_at, 0);
  EXPECT_EQ(ms - blocked_at, 200) << "ms";
  EXPECT_EQ(link_.transmit().missed_setpoints(), 0);
  far_.await();  // the other end reads again
  ASSERT_TRUE(link_.poll(kStart + std::chrono::milliseconds(ms)));
  EXPECT_FALSE(link_.transmit_stalled(kStart + std::chrono::milliseconds(ms + 200)));
}

// A question and its answer: 60 bytes, signed 86. The plain link has one length.
TEST(LineBudget, TheDelayThatAnAutopilotCannotFindOutIsThatOfSetPointAndOdometry) {
  EXPECT_NEAR(untold_delay({5760, 0}, false), (kSetpoint + kOdometry) / 5760.0, 1e-12);
  EXPECT_NEAR(untold_delay({5760, 0}, true), (kSetpoint + kOdometry + 2 * 13) / 5760.0, 1e-12);
  EXPECT_EQ(untold_delay({6001, 0}, false), 0) << "9.998 ms";
  EXPECT_GT(untold_delay({5999, 0}, false), 0);
  EXPECT_GT(untold_delay({8599, 0}, true), 0);
  EXPECT_EQ(untold_delay({8601, 0}, true), 0);
  EXPECT_EQ(untold_delay({}, false), 0) << "a socket";
}

}  // namespace
}  // namespace backwash::firmware_bridge::test
