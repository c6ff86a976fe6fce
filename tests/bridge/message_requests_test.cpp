// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/message_requests.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

namespace backwash::firmware_bridge::test {
namespace {

using namespace std::chrono_literals;

constexpr std::uint8_t kAccepted = 0, kTemporarilyRejected = 1, kDenied = 2, kUnsupported = 3, kFailed = 4;

/// An autopilot that answers in the tick after the question, or never.
class MessageRequestsTest : public testing::Test {
 protected:
  static constexpr std::uint16_t kInterval = 511;
  void run(std::chrono::milliseconds time) {
    for (const auto end = now_ + time; now_ < end; now_ += 20ms) {
      const auto wish = requests_.next(kUnknownAutopilot, answer_, now_);
      if (!wish) continue;
      ++asked_[wish->id];
      if (!answers_) continue;
      const auto given = results_.find(wish->id);
      answer_ = {{kInterval, given == results_.end() ? kAccepted : given->second}, now_ + 10ms};
    }
  }
  MessageRequests requests_;
  std::map<std::uint32_t, std::uint8_t> results_;  // others are granted
  std::map<std::uint32_t, int> asked_;
  Latest<CommandResult> answer_;
  bool answers_ = true;
  Time now_{1000s};
};

TEST_F(MessageRequestsTest, EachIsAskedForAtOnceAndAgainEveryTwoSeconds) {
  run(200ms);
  ASSERT_EQ(asked_.size(), std::size(kUsualStreams));
  run(19'500ms);
  for (const auto& [id, times] : asked_) EXPECT_EQ(times, 10) << id;
}

TEST_F(MessageRequestsTest, LaterRoundsDoNotHoldUpASlowLine) {
  run(2s);
  for (int n = 0; n < 50; ++n) {
    asked_.clear();
    run(200ms);
    int asked = 0;
    for (const auto& [id, times] : asked_) asked += times;
    EXPECT_LE(asked, 1) << n;
  }
}

TEST_F(MessageRequestsTest, WhatIsDeniedIsNotAskedForAgainUntilTheAutopilotIsAnotherOne) {
  const auto odometry = mavlink::Odometry::kId;
  for (const std::uint8_t denial : {kDenied, kUnsupported, kFailed}) {
    asked_.clear();
    results_[odometry] = denial;
    requests_.forget();
    run(60s);
    EXPECT_EQ(asked_[odometry], 1) << int{denial};
    EXPECT_GE(asked_[mavlink::LocalPositionNed::kId], 29);
    requests_.forget();
    run(10s);
    EXPECT_EQ(asked_[odometry], 2) << int{denial};
  }
}

TEST_F(MessageRequestsTest, ADenialIsOfTheMessageThatWasAskedForAndOfNoOther) {
  for (const auto& denied : kUsualStreams) {
    asked_.clear();
    results_ = {{denied.id, kDenied}};
    requests_.forget();
    run(10s);
    for (const auto& wish : kUsualStreams) EXPECT_EQ(asked_[wish.id] == 1, wish.id == denied.id) << wish.id;
  }
}

TEST_F(MessageRequestsTest, WhatIsPutOffIsAskedForAgain) {
  results_[mavlink::Odometry::kId] = kTemporarilyRejected;
  run(20s);
  EXPECT_GE(asked_[mavlink::Odometry::kId], 9);
}

TEST_F(MessageRequestsTest, SilenceDelaysTheOthersAndDeniesNothing) {
  answers_ = false;
  run(20s);
  for (const auto& wish : kUsualStreams) EXPECT_GE(asked_[wish.id], 8) << wish.id;
}

// A station on the same line has asked for less: before its turn, at once, and again while that lasts.
TEST_F(MessageRequestsTest, APoseThatIsLateIsAskedForBeforeItsTurn) {
  Telemetry t;
  const auto say = [&](std::uint32_t ms) {
    t.take(mavlink::LocalPositionNed{.time_boot_ms = ms}, now_);
    t.take(mavlink::AttitudeQuaternion{.time_boot_ms = ms, .q1 = 1}, now_);
  };
  EXPECT_FALSE(requests_.late(t, now_)) << "none came yet: it is asked for in its turn";
  say(0);
  for (std::uint32_t n = 1; n < 20; ++n) {
    now_ += 20ms;
    say(20 * n);
    EXPECT_FALSE(requests_.late(t, now_));
  }
  const auto begin = now_;
  std::map<std::uint32_t, std::vector<int>> asked_ms;
  for (; now_ < begin + 600ms; now_ += 20ms)
    if (const auto stream = requests_.late(t, now_))
      asked_ms[stream->id].push_back(static_cast<int>((now_ - begin) / 1ms));
  EXPECT_EQ(asked_ms[kPositionStream.id], (std::vector<int>{120, 320, 520}));
  EXPECT_EQ(asked_ms[kAttitudeStream.id], (std::vector<int>{180, 380, 580})) << "both before HOLD at 300 ms";
  now_ += 200ms;
  t.take(mavlink::LocalPositionNed{.time_boot_ms = 5000}, now_);
  const auto other = requests_.late(t, now_);
  ASSERT_TRUE(other) << "the position is back";
  EXPECT_EQ(other->id, kAttitudeStream.id);
}

TEST_F(MessageRequestsTest, AnAutopilotThatDeniesEverythingIsLeftInPeace) {
  for (const auto& wish : kUsualStreams) results_[wish.id] = kDenied;
  run(60s);
  for (const auto& [id, times] : asked_) EXPECT_EQ(times, 1) << id;
}

}  // namespace
}  // namespace backwash::firmware_bridge::test
