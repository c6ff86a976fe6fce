// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/autopilot/same_flight.hpp"

#include <gtest/gtest.h>

#include <random>

namespace backwash::log {
namespace {

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
