// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/line_loss.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/bridge/emulated_controller.hpp"

namespace backwash::firmware_bridge::test {
namespace {

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
