// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/in/sender_clock.hpp"

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

// What is allowed for drift counts by time, whatever the rate. A clock that loses 80 ppm, each sample 1 ms on the way:
// allowed for by the sample, 30 Hz would fall behind it by 20 us every second.
TEST(SenderClock, FollowsADriftOf80PpmAtEveryRate) {
  for (const std::int64_t rate : {30, 500}) {
    SenderClock clock;
    std::int64_t worst = 0;
    for (std::int64_t n = 0; n < rate * 600; ++n) {
      const std::int64_t taken = 1'000 * kMs / rate * n;
      const std::int64_t stamp = 1'700'000'000'000'000'000 + taken - taken / 12'500;
      worst = std::max(worst, std::abs(clock.taken_ns(stamp, taken + kMs) - taken));
    }
    EXPECT_LE(worst, 1.1 * kMs) << rate << " Hz";
  }
}

// One sample in 5 s comes in 1 ms, the others in 20 ms: the fastest stands for its offset until the next. Allowed for
// by the sample, 500 Hz would lose 5 ms meanwhile.
TEST(SenderClock, KeepsTheFastestSamplesOffsetForSecondsAtEveryRate) {
  for (const std::int64_t rate : {30, 500}) {
    SenderClock clock;
    std::int64_t worst = 0;
    for (std::int64_t n = 0; n < rate * 60; ++n) {
      const std::int64_t taken = 1'000 * kMs / rate * n, way = n % (5 * rate) == 0 ? kMs : 20 * kMs;
      const std::int64_t found = clock.taken_ns(1'700'000'000'000'000'000 + taken, taken + way);
      worst = std::max(worst, std::abs(found - taken));
    }
    EXPECT_LE(worst, 1.6 * kMs) << rate << " Hz";
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
