// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/clock_filter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

namespace backwash::firmware_bridge::test {
namespace {

constexpr std::int64_t kMillisecond = 1'000'000, kOffset = 123'456'789'000;

/// An exchange whose question was `there` on its way and whose answer `back`.
ClockOffset exchange(std::int64_t there, std::int64_t back, std::int64_t offset = kOffset) {
  const std::int64_t asked = 5'000 * kMillisecond, answered = asked + there + offset, heard = asked + there + back;
  return {answered - (asked + (heard - asked) / 2), heard - asked};
}

TEST(ClockFilter, KnowsNothingBeforeTheFirstExchange) { EXPECT_FALSE(ClockFilter().best()); }

TEST(ClockFilter, BelievesTheShortestRoundTrip) {
  ClockFilter filter;
  filter.add(exchange(20 * kMillisecond, kMillisecond));  // half of what one way waited is in the offset
  EXPECT_NEAR(filter.best()->offset_ns, kOffset + 9.5 * kMillisecond, 1);
  filter.add(exchange(kMillisecond, kMillisecond));
  filter.add(exchange(kMillisecond, 18 * kMillisecond));
  EXPECT_EQ(filter.best()->offset_ns, kOffset);
  EXPECT_EQ(filter.best()->round_trip_ns, 2 * kMillisecond);
}

// A line is as slow as its quickest exchange of late: what waits once says nothing, what came before says nothing.
TEST(ClockFilter, TellsTheShortestOfTheNewestExchanges) {
  ClockFilter filter;
  for (int n = 0; n < 3; ++n) filter.add(exchange(kMillisecond, kMillisecond));
  EXPECT_FALSE(filter.shortest(4)) << "there were three";
  for (int n = 1; n <= 20; ++n) {
    filter.add(exchange(kMillisecond, (n % 4 == 0 ? 9 : 50) * kMillisecond));
    const std::int64_t least = n < 4 ? 2 : 10;
    EXPECT_EQ(filter.shortest(4), least * kMillisecond) << n;
  }
}

TEST(ClockFilter, IsFiveTimesCloserThanTheMeanOfWhatItWasGiven) {
  std::mt19937 random(7);
  std::exponential_distribution<double> waits(1 / 8e6);  // 8 ms in the mean, on the way back alone
  ClockFilter filter;
  double mean = 0, filtered = 0;
  constexpr int kRounds = 2000;
  for (int n = 0; n < kRounds; ++n) {
    const auto e = exchange(kMillisecond, kMillisecond + static_cast<std::int64_t>(waits(random)));
    filter.add(e);
    mean += std::abs(static_cast<double>(e.offset_ns - kOffset)) / kRounds;
    filtered += std::abs(static_cast<double>(filter.best()->offset_ns - kOffset)) / kRounds;
  }
  EXPECT_LT(filtered, mean / 5) << mean << " " << filtered;
}

TEST(ClockFilter, FollowsADriftingClock) {
  ClockFilter filter;
  std::int64_t offset = kOffset;
  for (int n = 0; n < 1000; ++n) {
    offset += 25'000;  // 50 ppm at 2 Hz
    filter.add(exchange(kMillisecond, kMillisecond, offset));
    EXPECT_LE(std::abs(filter.best()->offset_ns - offset), 16 * 25'000) << n;
  }
}

TEST(ClockFilter, ForgetsAClockThatBeganAnew) {
  ClockFilter filter;
  for (int n = 0; n < 16; ++n) filter.add(exchange(kMillisecond / 2, kMillisecond / 2));
  filter.add(exchange(4 * kMillisecond, 4 * kMillisecond, 1'000 * kMillisecond));
  EXPECT_EQ(filter.best()->offset_ns, 1'000 * kMillisecond);
}

TEST(ClockFilter, ALateAnswerIsNoNewClock) {
  ClockFilter filter;
  filter.add(exchange(kMillisecond, kMillisecond));
  filter.add(exchange(kMillisecond, 900 * kMillisecond));
  EXPECT_EQ(filter.best()->offset_ns, kOffset);
}

}  // namespace
}  // namespace backwash::firmware_bridge::test
