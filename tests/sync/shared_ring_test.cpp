// SPDX-License-Identifier: BSD-3-Clause
#include "core/sync/shared_ring.hpp"

#include <gtest/gtest.h>

#include <array>
#include <thread>
#include <vector>

namespace backwash::sync {
namespace {

struct Record {
  int writer = 0, number = 0, again = 0;
};

TEST(SharedRing, RefusesAndCountsWhatDoesNotFit) {
  SharedRing<int, 4> ring;
  for (int n = 0; n < 6; ++n) EXPECT_EQ(ring.push(n), n < 4);
  EXPECT_EQ(ring.lost(), 2u);
  for (int round = 0; round < 3; ++round) {
    for (int n = 0; n < 4; ++n) EXPECT_EQ(ring.pop(), n);
    EXPECT_EQ(ring.pop(), std::nullopt);
    for (int n = 0; n < 4; ++n) EXPECT_TRUE(ring.push(n));
  }
  EXPECT_EQ(ring.lost(), 2u);
}

TEST(SharedRing, GivesEachWritersRecordsWholeAndInOrderAndLosesNoneUncounted) {
  constexpr int kWriters = 4, kEach = 10'000;
  SharedRing<Record, 64> ring;
  std::atomic<int> running{kWriters};
  std::vector<std::jthread> writers;
  for (int w = 0; w < kWriters; ++w)
    writers.emplace_back([&, w] {
      for (int n = 1; n <= kEach; ++n)
        if (!ring.push({w, n, n})) std::this_thread::yield();  // or the reader would never run on one processor
      --running;
    });
  std::array<int, kWriters> last{};
  std::uint64_t got = 0;
  for (bool end = false; !end;) {
    end = running == 0;
    while (const auto r = ring.pop()) {
      ASSERT_EQ(r->number, r->again);
      ASSERT_GT(r->number, last[static_cast<std::size_t>(r->writer)]);
      last[static_cast<std::size_t>(r->writer)] = r->number;
      ++got;
    }
  }
  EXPECT_EQ(got + ring.lost(), std::uint64_t{kWriters} * kEach);
  EXPECT_GT(got, 1000u);
}

}  // namespace
}  // namespace backwash::sync
