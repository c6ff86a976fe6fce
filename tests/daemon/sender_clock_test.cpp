// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/sender_clock.hpp"

#include <gtest/gtest.h>

#include <random>

namespace backwash::daemon {
namespace {

constexpr std::int64_t kMs = 1'000'000;

TEST(SenderClock, KeepsTheStampsOfASenderOnTheSameClock) {
  SenderClock clock;
  for (std::int64_t t = 5'000 * kMs; t < 6'000 * kMs; t += 20 * kMs) EXPECT_EQ(clock.taken_ns(t, t + 7 * kMs), t);
}

// Wall time 1.7e18 ns ahead, running 50 ppm fast; 1 to 15 ms on the way, 1 ms at least every few samples.
TEST(SenderClock, FindsWhenASampleOnAnotherClockWasTakenToTwoMillisecondsAndNeverInTheFuture) {
  std::mt19937 random(1);
  std::uniform_int_distribution<std::int64_t> way(1 * kMs, 15 * kMs);
  SenderClock clock;
  for (std::int64_t n = 0; n < 50 * 600; ++n) {
    const std::int64_t taken = 20 * kMs * n, received = taken + (n % 7 == 0 ? kMs : way(random));
    const std::int64_t stamp = 1'700'000'000'000'000'000 + taken + taken / 20'000;
    const std::int64_t found = clock.taken_ns(stamp, received);
    EXPECT_LE(found, received);
    if (n > 7) {
      EXPECT_LE(std::abs(found - taken), 2 * kMs) << n;
    }
  }
}

TEST(SenderClock, FollowsAStepOfTheSendersClockInOneSampleInBothDirections) {
  SenderClock clock;
  const std::int64_t hour = 3'600'000 * kMs;
  std::int64_t offset = 10 * hour, t = 20 * hour;
  for (const std::int64_t step : {hour, -2 * hour, std::int64_t{300} * kMs, std::int64_t{-300} * kMs}) {
    offset += step;
    for (int n = 0; n < 20; ++n, t += 20 * kMs) EXPECT_NEAR(clock.taken_ns(t + offset, t + kMs), t, 2 * kMs);
  }
}

}  // namespace
}  // namespace backwash::daemon
