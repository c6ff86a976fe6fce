// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/gpio/stop_switch.hpp"

#include <gtest/gtest.h>

namespace backwash::firmware_bridge::test {
namespace {

using namespace std::chrono_literals;

/// A switch that is looked at every 5 ms, as the daemon does.
class StopSwitchTest : public testing::Test {
 protected:
  static constexpr bool kOpen = true, kClosed = false;
  void hold(bool open, std::chrono::milliseconds time) {
    for (const auto end = now_ + time; now_ < end; now_ += 5ms) switch_.see(open, now_);
    switch_.see(open, now_);
  }
  /// Seen in both positions, closed at the end.
  void test_it() {
    hold(kClosed, 25ms);
    hold(kOpen, 25ms);
    hold(kClosed, 25ms);
  }
  StopSwitch switch_;
  StopSwitch::Time now_{1000s};
};

TEST_F(StopSwitchTest, IsLostUntilItIsSeen) { EXPECT_EQ(switch_.state(), SwitchState::lost); }

TEST_F(StopSwitchTest, MayBeFlownOnOnlyOnceItWasSeenInBothPositions) {
  for (const bool stuck : {kOpen, kClosed}) {
    switch_ = {};
    hold(stuck, 60s);
    EXPECT_EQ(switch_.state(), SwitchState::untested) << "stuck " << stuck;
  }
  hold(kOpen, 25ms);
  EXPECT_EQ(switch_.state(), SwitchState::pressed);
  hold(kClosed, 25ms);
  EXPECT_EQ(switch_.state(), SwitchState::released);
}

TEST_F(StopSwitchTest, APositionCountsOnceItWasHeldForTwentyMilliseconds) {
  test_it();
  hold(kOpen, 0ms);
  now_ += 19ms;
  switch_.see(kOpen, now_);
  EXPECT_EQ(switch_.state(), SwitchState::released);
  now_ += 1ms;
  switch_.see(kOpen, now_);
  EXPECT_EQ(switch_.state(), SwitchState::pressed);
}

TEST_F(StopSwitchTest, APulseBetweenTwoLooksIsNoPositionAndNoTest) {
  hold(kClosed, 25ms);
  for (int n = 0; n < 5; ++n) {
    switch_.see(kOpen, now_ + 1ms);  // its edges
    switch_.see(kClosed, now_ + 3ms);
    now_ += 5ms;
    hold(kClosed, 50ms);
    EXPECT_EQ(switch_.state(), SwitchState::untested);
  }
}

// The thread that looks was held up: both edges are read at once, each with its own time.
TEST_F(StopSwitchTest, APressThatWasHeldCountsAlsoIfItIsOverBeforeAnybodyLooks) {
  for (const auto& [held, counts] : {std::pair(19ms, false), std::pair(20ms, true), std::pair(80ms, true)}) {
    switch_ = {};
    test_it();
    switch_.see(kOpen, now_ += 5ms);
    switch_.see(kClosed, now_ += held);
    EXPECT_EQ(switch_.state(), counts ? SwitchState::pressed : SwitchState::released) << held.count();
    hold(kClosed, 25ms);
    EXPECT_EQ(switch_.state(), SwitchState::released) << held.count();
  }
}

TEST_F(StopSwitchTest, ALevelWhoseEdgeWasLostIsFoundAllTheSame) {
  test_it();
  hold(kOpen, 25ms);  // readings alone
  EXPECT_EQ(switch_.state(), SwitchState::pressed);
}

TEST_F(StopSwitchTest, ABouncingContactSettlesWithoutAnyOtherStateInBetween) {
  test_it();
  for (int n = 0; n < 10; ++n, now_ += 1ms) {
    switch_.see(n % 2 == 0, now_);
    EXPECT_EQ(switch_.state(), SwitchState::released);
  }
  hold(kOpen, 25ms);
  EXPECT_EQ(switch_.state(), SwitchState::pressed);
}

TEST_F(StopSwitchTest, WhatHoldsNoLevelForATenthOfASecondChatters) {
  test_it();
  const auto begun = now_ + 15ms;
  bool chattered = false;
  for (int n = 1; n < 20; ++n) {
    now_ += 15ms;
    switch_.see(n % 2 != 0, now_);
    const bool chatters = switch_.state() == SwitchState::chattering;
    EXPECT_EQ(chatters, now_ - begun >= StopSwitch::kChatter) << n;
    chattered = chattered || chatters;
  }
  EXPECT_TRUE(chattered);
  hold(kClosed, 25ms);
  EXPECT_EQ(switch_.state(), SwitchState::released) << "it rests again";
}

TEST_F(StopSwitchTest, ChatterFromTheStartIsNoTest) {
  for (int n = 0; n < 100; ++n, now_ += 7ms) switch_.see(n % 2 == 0, now_);
  EXPECT_EQ(switch_.state(), SwitchState::chattering);
  hold(kClosed, 25ms);
  EXPECT_EQ(switch_.state(), SwitchState::untested);
}

TEST_F(StopSwitchTest, ALineThatWasGoneIsTestedAnew) {
  test_it();
  switch_.lose();
  EXPECT_EQ(switch_.state(), SwitchState::lost);
  hold(kClosed, 1000ms);
  EXPECT_EQ(switch_.state(), SwitchState::untested);
}

TEST(StrobeTest, MovesOnceATickAndStopsWithTheTicks) {
  Strobe strobe;
  bool last = strobe.level(0);
  for (std::uint64_t ticks = 1; ticks < 10; ++ticks) {
    const bool level = strobe.level(ticks);
    EXPECT_NE(level, last);
    for (int n = 0; n < 5; ++n) EXPECT_EQ(strobe.level(ticks), level) << "looked at again, no tick in between";
    last = level;
  }
}

TEST(SignalTest, TellsItsThreeStatesApart) {
  const auto share = [](Signal signal) {
    int on = 0, changes = 0;
    for (int ms = 0; ms < 10'000; ++ms) {
      const auto at = [](int n) { return std::chrono::steady_clock::time_point(100s + std::chrono::milliseconds(n)); };
      on += lit(signal, at(ms));
      changes += lit(signal, at(ms)) != lit(signal, at(ms + 1));
    }
    return std::pair(on, changes);
  };
  EXPECT_EQ(share(Signal::idle), std::pair(500, 20));
  EXPECT_EQ(share(Signal::commanding), std::pair(10'000, 0));
  EXPECT_EQ(share(Signal::fault), std::pair(5'000, 100));
}

}  // namespace
}  // namespace backwash::firmware_bridge::test
