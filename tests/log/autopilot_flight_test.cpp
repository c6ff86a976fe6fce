// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

#include "core/log/autopilot/autopilot_clock.hpp"
#include "core/log/autopilot/autopilot_flight.hpp"
#include "core/log/autopilot/same_flight.hpp"
#include "core/log/raw/tick_log.hpp"

namespace backwash::log {
namespace {

constexpr std::int64_t kTick_ns = 20'000'000;

/// Ticks from `first_ns` on, in each of which the autopilot says where it is at 2 m/s along x.
RawLog told(std::int64_t first_ns, int ticks) {
  RawLog log;
  for (int n = 0; n < ticks; ++n) {
    track::TickInput in;
    in.now_ns = first_ns + n * kTick_ns;
    track::AutopilotFacts::Pose pose;
    pose.at_ns = in.now_ns;
    pose.state.p_W = {2e-9 * static_cast<double>(in.now_ns), 1, 2};
    if (n % 2 == 0) in.autopilot.pose = pose;
    const TickInputRecord row = encode(in).input;
    RawRecord record{{in.now_ns, RecordKind::tick_input, sizeof row}, std::vector<std::uint8_t>(sizeof row)};
    std::memcpy(record.bytes.data(), &row, sizeof row);
    log.records.push_back(std::move(record));
  }
  return log;
}

/// The same way as its own log has it, `off` beside it.
std::vector<AutopilotPose> logged(std::int64_t first_ns, int rows, const Vec3& off) {
  std::vector<AutopilotPose> poses;
  for (std::int64_t t = first_ns; t < first_ns + rows * kTick_ns; t += kTick_ns)
    poses.push_back({t, {{Vec3(2e-9 * static_cast<double>(t), 1, 2) + off, Vec3::Zero()}, {}}});
  return poses;
}

TEST(AutopilotFlight, IsAsFarFromTheLinkAsItIsBesideIt) {
  const RawLog log = told(1'000'000'000, 200);
  EXPECT_NEAR(distance_from_link(log, logged(1'000'000'000, 200, Vec3::Zero())).value(), 0, 1e-9);
  EXPECT_NEAR(distance_from_link(log, logged(2'000'000'000, 50, {0, 3, 4})).value(), 5, 1e-9) << "a part of the time";
  EXPECT_NEAR(distance_from_link(log, logged(1'005'000'000, 200, Vec3::Zero())).value(), 0.01, 1e-9) << "5 ms at 2 m/s";
}

TEST(AutopilotFlight, OfAnotherTimeHasNoDistance) {
  const RawLog log = told(1'000'000'000, 200);
  EXPECT_FALSE(distance_from_link(log, logged(6'000'000'000, 200, Vec3::Zero())));
  EXPECT_FALSE(distance_from_link(log, logged(0, 40, Vec3::Zero())));
  EXPECT_FALSE(distance_from_link(log, {}));
}

// Both logs hold a minute on the pad; in the air they have nothing in common.
TEST(AutopilotFlight, OfAnotherFlightFromTheSamePadIsFarInTheAir) {
  RawLog log = told(0, 3000);
  for (RawRecord& record : log.records) {
    TickInputRecord row;
    std::memcpy(&row, record.bytes.data(), sizeof row);
    auto in = decode(row, nullptr);
    if (in.autopilot.pose) in.autopilot.pose->state.p_W.x() = std::max(0.0, 1e-9 * static_cast<double>(in.now_ns) - 50);
    row = encode(in).input;
    std::memcpy(record.bytes.data(), &row, sizeof row);
  }
  auto still = logged(0, 3000, Vec3::Zero());
  for (auto& pose : still) pose.moving.state.p_W = {0, 1, 2};
  EXPECT_GT(distance_from_link(log, still).value(), 3);
}

TEST(AutopilotFlight, APoseThatIsNoNumberIsNoDistance) {
  auto poses = logged(1'000'000'000, 200, Vec3::Zero());
  for (std::size_t n = 0; n < 150; ++n) poses[n].moving.state.p_W.x() = std::nan("");
  EXPECT_NEAR(distance_from_link(told(1'000'000'000, 200), poses).value(), 0, 1e-9);
  for (auto& pose : poses) pose.moving.state.p_W.x() = std::nan("");
  EXPECT_FALSE(distance_from_link(told(1'000'000'000, 200), poses));
}

// Clocks that are known to the test, exchanges with delays on both ways.

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

/// Flights of few distinct places, so that all kinds of overlap come about; every flight begins at one place.
std::vector<FlightMark> drawn(std::uint64_t seed, std::size_t count) {
  std::mt19937_64 rng(seed);
  std::vector<FlightMark> marks;
  for (std::size_t f = 0; f < count; ++f) {
    const auto from = rng() % 400, length = 20 + rng() % 200;
    std::vector<std::size_t> places{0};
    for (auto p = from; p < from + length; ++p)
      if (rng() % 8 != 0) places.push_back(1 + p);
    marks.emplace_back(std::move(places));
  }
  return marks;
}

TEST(SameFlights, AreThoseThatComparingEachWithAllBeforeItFinds) {
  std::size_t twins = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const auto marks = drawn(seed, 12);
    std::vector<std::size_t> expected(marks.size());
    for (std::size_t f = 0; f < marks.size(); ++f) {
      expected[f] = f;
      for (std::size_t g = 0; g < f && expected[f] == f; ++g)
        if (expected[g] == g && marks[f].shared(marks[g]) >= kSameFlight) expected[f] = g;
      twins += expected[f] != f ? 1 : 0;
    }
    EXPECT_EQ(same_flights(marks), expected) << "seed " << seed;
  }
  EXPECT_GT(twins, 200u);
}

TEST(SameFlights, FewPlacesSayNothing) {
  EXPECT_EQ(same_flights({FlightMark({1, 2, 3}), FlightMark({1, 2, 3})}), (std::vector<std::size_t>{0, 1}));
  EXPECT_EQ(same_flights({}), std::vector<std::size_t>{});
}

}  // namespace
}  // namespace backwash::log
