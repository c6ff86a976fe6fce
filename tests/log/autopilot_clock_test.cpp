// SPDX-License-Identifier: BSD-3-Clause
// Clocks that are known to the test, exchanges with delays on both ways.
#include "core/log/autopilot/autopilot_clock.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

namespace backwash::log {
namespace {

/// A log of TIMESYNC between a clock and ours.
struct Exchanges {
  static constexpr double kBoot = 4321.5;  // s on our clock when theirs began
  double rate = 0;                         // theirs slower than ours by this share
  std::mt19937 random{20261125};
  RawLog log;

  std::int64_t theirs(double ours_s) const { return std::llround(1e9 * (ours_s - kBoot) / (1 + rate)); }
  void frame(bool out, double t_s, std::int64_t tc1, std::int64_t ts1, bool second = true) {
    std::vector<std::uint8_t> bytes = second ? std::vector<std::uint8_t>{0xFD, 16, 0, 0, 7, 1, 1, 111, 0, 0}
                                             : std::vector<std::uint8_t>{0xFE, 16, 7, 1, 1, 111};
    const std::size_t head = bytes.size();
    bytes.resize(head + 16);
    std::memcpy(bytes.data() + head, &tc1, 8);
    std::memcpy(bytes.data() + head + 8, &ts1, 8);
    if (second) {  // zeros at the end are not sent
      while (bytes.back() == 0) bytes.pop_back();
      bytes[1] = static_cast<std::uint8_t>(bytes.size() - head);
    }
    bytes.resize(bytes.size() + 2);  // a checksum, which the link has held against it
    log.records.push_back({{std::llround(1e9 * t_s), out ? RecordKind::frame_out : RecordKind::frame_in,
                            static_cast<std::uint32_t>(bytes.size())},
                           bytes});
  }
  /// Half a second apart; a way takes 0.3 ms, and more by an exponential delay of 2 ms each.
  void exchange(double from_s, double until_s, bool second = true) {
    std::exponential_distribution<double> wait(1 / 0.002);
    for (double t = from_s; t < until_s; t += 0.5) {
      const std::int64_t asked = std::llround(1e9 * t);
      frame(true, t, 0, asked, second);
      const double there = t + 3e-4 + wait(random);
      frame(false, there + 3e-4 + wait(random), theirs(there), asked, second);
      frame(false, t + 0.1, 0, theirs(t + 0.1), second);  // its own question, and our answer
      frame(true, t + 0.1, std::llround(1e9 * (t + 0.1)), theirs(t + 0.1), second);
    }
  }
};

TEST(AutopilotClock, OfAnyRateIsFoundToAMillisecond) {
  for (const double rate : {0.0, 50e-6, -100e-6}) {
    Exchanges e;
    e.rate = rate;
    e.exchange(5000, 5300, rate != 0);
    const auto pairs = clock_pairs(e.log);
    EXPECT_EQ(pairs.size(), 600u);
    const auto line = clock_line(pairs);
    EXPECT_EQ(line.pairs, 60u);
    EXPECT_NEAR(line.rate, rate, 3e-6);
    for (double t = 4990; t < 5310; t += 10)
      EXPECT_NEAR(1e-9 * static_cast<double>(line.ours(1e-9 * static_cast<double>(e.theirs(t)))), t, 1e-3);
    EXPECT_GT(line.rms_s, 1e-6);
    EXPECT_LT(line.rms_s, 1e-3);
    EXPECT_LE(line.rms_s, line.largest_s);
    EXPECT_LE(line.largest_s, line.round_trip_s / 2);
  }
}

TEST(AutopilotClock, ThatBeganAnewIsItsLastStart) {
  Exchanges e;
  e.exchange(9000, 9100);
  RawLog before = e.log;
  Exchanges later;
  later.exchange(5000, 5100);
  for (auto& r : later.log.records) before.records.push_back(r);
  const auto line = clock_line(clock_pairs(before));
  EXPECT_NEAR(1e-9 * static_cast<double>(line.ours(1e-9 * static_cast<double>(later.theirs(5050)))), 5050, 1e-3);
  EXPECT_LT(line.largest_s, 2e-3);
}

TEST(AutopilotClock, IsNotToldByAnswersToOthersNorByDamagedFrames) {
  Exchanges e;
  e.frame(true, 5000, 0, 5'000'000'000'000);
  e.frame(false, 5000.01, 123, 77);  // to another's question
  EXPECT_TRUE(clock_pairs(e.log).empty());
  for (std::size_t size = 0; size < 12; ++size) {
    RawLog cut = e.log;
    for (auto& r : cut.records) r.bytes.resize(std::min(r.bytes.size(), size));
    EXPECT_TRUE(clock_pairs(cut).empty());
  }
  e.frame(false, 5000.02, 123, 5'000'000'000'000);
  EXPECT_EQ(clock_pairs(e.log).size(), 1u);
  EXPECT_EQ(clock_line(clock_pairs(e.log)).rate, 0);
}

}  // namespace
}  // namespace backwash::log
