// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <deque>
#include <random>

#include "firmware_bridge/line_budget.hpp"
#include "firmware_bridge/line_loss.hpp"
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
  queue.push(frame_of(1), Kind::odometry);
  queue.push(frame_of(2), Kind::other);
  queue.push(frame_of(3), Kind::odometry);
  queue.push(frame_of(4), Kind::setpoint);
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
  queue.push(frame_of(1), Kind::odometry);
  ASSERT_TRUE(queue.flush([](auto) -> tl::expected<std::size_t, PortError> { return 4U; }));
  queue.push(frame_of(2), Kind::setpoint);
  queue.push(frame_of(3), Kind::odometry);
  queue.push(frame_of(4), Kind::odometry);
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
  for (; ms < 5000 && link_.fault(kStart + std::chrono::milliseconds(ms)) != LinkFault::transmit_stalled; ms += 20) {
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

void exchange(LineLoss& loss, bool answered) {
  loss.asked();
  if (answered) loss.answered();
}

TEST(LineLoss, CountsWhatIsMissingFromTheCountOfFramesAcrossItsWrap) {
  LineLoss loss;
  std::uint8_t sequence = 250;
  for (int n = 0; n < 200; ++n) {
    exchange(loss, n % 4 != 0);
    EXPECT_EQ(loss.shares(true, false).has_value(), n >= static_cast<int>(LineLoss::kQuestions)) << n;
    for (int frame = 0; frame < 10; ++frame, ++sequence)
      if (frame != 3) loss.heard(sequence, 0);
  }
  EXPECT_DOUBLE_EQ(loss.shares(true, false)->in, 0.1);
  EXPECT_DOUBLE_EQ(loss.shares(true, false)->out, 1 - 0.75 / 0.9) << "an answer has to come back, too";
  EXPECT_LT(loss.shares(true, false)->odometry, loss.shares(true, false)->out) << "at least";
  EXPECT_GT(loss.shares(false, false)->odometry, 0.4);
  EXPECT_GT(loss.shares(false, false)->odometry, loss.shares(false, true)->odometry) << "all frames are longer then";
}

TEST(LineLoss, IsNoneWhereFramesAreUnknownOrOvertakeOneAnother) {
  LineLoss loss;
  std::uint64_t unknown = 0;
  for (int n = 0; n < 100; ++n) {
    exchange(loss, true);
    for (const int frame : {0, 1, 4, 3, 5, 6, 7}) {
      if (frame == 4) ++unknown;  // 2 is of a message that the parser passes over
      loss.heard(static_cast<std::uint8_t>(8 * n + frame), unknown);
    }
    loss.heard(static_cast<std::uint8_t>(8 * n + 7), unknown);  // twice
  }
  EXPECT_EQ(loss.shares(true, false)->in, 0) << "2 and 3 did arrive, and 7 only once";
  EXPECT_EQ(loss.shares(true, false)->out, 0);
}

TEST(LineLoss, OfAnAutopilotThatAnswersNoQuestionIsNotKnown) {
  LineLoss loss;
  for (int n = 0; n < 200; ++n) {
    exchange(loss, false);
    loss.heard(static_cast<std::uint8_t>(n), 0);
  }
  EXPECT_FALSE(loss.shares(true, false));
}

TEST_F(LinkTest, AQuestionIsAnsweredHoweverLateOnASlowLineAndCountsOnlyWhileSomebodyIsThere) {
  introduce_vehicle();
  std::array<std::int64_t, 5> asked{};
  for (std::size_t n = 0; n < asked.size(); ++n) {
    ASSERT_TRUE(link_.send_timesync(kStart + n * 500ms));
    asked[n] = heard_one<mavlink::Timesync>().ts1;
    if (n > 0)
      say_and_poll(mavlink::Timesync{.tc1 = asked[n - 1] + 350'000'000, .ts1 = asked[n - 1]},
                   kStart + n * 500ms + 200ms);
  }
  ASSERT_TRUE(link_.round_trip(kStart + 2200ms)) << "each answer came after the next question";
  EXPECT_EQ(*link_.round_trip(kStart + 2200ms), 700'000'000);
  say_and_poll(px4_heartbeat(false, 1), kStart + 2300ms);
  for (int n = 0; n < 200; ++n) {
    const Time now = kStart + 2300ms + n * 500ms;
    ASSERT_TRUE(link_.send_timesync(now));
    far_.read();
  }
  EXPECT_FALSE(link_.loss()) << "nobody was there to answer";
}

/// A line that loses each byte with the same chance, both ways.
struct LossyLine : LinkTest {
  std::vector<std::uint8_t> what_passes(std::span<const std::uint8_t> bytes) {
    std::vector<std::uint8_t> passed;
    for (const auto byte : bytes)
      if (!lost(random)) passed.push_back(byte);
    return passed;
  }
  template <class Message>
  void say_lossily(const Message& message) {
    const auto passed = what_passes(mavlink::encode_frame({kVehicle, 1, sequence_++}, message).view());
    far_.write(passed);
    written += passed.size();
  }
  std::mt19937 random{3};
  std::bernoulli_distribution lost{0.0};
  std::size_t written = 0;
};

TEST_F(LossyLine, TellsWhatOdometryLosesFromItsShortFrames) {
  introduce_vehicle();
  const std::size_t begun = link_.received().bytes;
  Time now = kStart;
  std::vector<double> told;
  for (const double chance : {0.0, 0.001, 0.006}) {
    lost = std::bernoulli_distribution(chance);
    int sent = 0, arrived = 0;
    for (int n = 0; n < 600; ++n, now += 500ms) {
      ASSERT_TRUE(link_.send_timesync(now));
      const VioSample vio{1, Vec3(1, 2, 3), Eigen::Quaterniond::Identity(), Vec3::Ones(), Vec3::Ones(), {}, {}, {}, 7};
      ASSERT_TRUE(link_.send_odometry(vio));
      ++sent;
      for (const auto& frame : mavlink::test::parse(what_passes(far_.await()))) {
        arrived += frame.frame.id == mavlink::Odometry::kId;
        if (frame.frame.id != mavlink::Timesync::kId) continue;
        say_lossily(mavlink::Timesync{.tc1 = 1, .ts1 = mavlink::decode<mavlink::Timesync>(frame.payload).ts1});
      }
      say_lossily(px4_heartbeat(false, 1));
      for (int k = 0; k < 5; ++k) say_lossily(mavlink::LocalPositionNed{.time_boot_ms = 1, .x = 3});
      for (int wait = 0; wait < 1000 && link_.received().bytes < begun + written; ++wait) {
        ASSERT_TRUE(link_.poll(now));
        ::usleep(100);
      }
    }
    const double truth = 1 - static_cast<double>(arrived) / sent;
    ASSERT_TRUE(link_.loss());
    EXPECT_LE(link_.loss()->odometry, truth + 0.1) << chance;
    EXPECT_GE(link_.loss()->odometry, truth - 0.45) << chance;
    told.push_back(link_.loss()->odometry);
  }
  EXPECT_EQ(told[0], 0);
  EXPECT_LT(told[1], 0.5);
  EXPECT_GT(told[2], 0.5) << "a quarter arrives";
}

}  // namespace
}  // namespace backwash::firmware_bridge::test
