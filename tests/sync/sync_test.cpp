// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <barrier>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <optional>
#include <thread>
#include <utility>

#include "core/sync/atomic_optional.hpp"
#include "core/sync/handover.hpp"
#include "core/sync/latest_value.hpp"
#include "core/sync/record_ring.hpp"

namespace backwash::sync {
namespace {

// A value whose every word must agree: a torn read shows at once.
using Wide = std::array<std::uint64_t, 64>;
Wide wide(std::uint64_t n) {
  Wide w;
  w.fill(n);
  return w;
}
bool whole(const Wide& w) {
  for (const auto word : w)
    if (word != w[0]) return false;
  return true;
}
constexpr std::uint64_t kRounds = 300'000;

#if defined(__SANITIZE_THREAD__)
// That the runs with ThreadSanitizer can fail: a hand-over with two writers, which none of them may have.
void write_from_two_threads() {
  LatestValue<Wide> value;
  std::barrier both(2);
  const auto write = [&] {
    both.arrive_and_wait();
    for (std::uint64_t n = 0; n < 20'000; ++n) value.write(wide(n));
  };
  std::thread other(write);
  write();
  other.join();
  std::exit(0);
}

TEST(ThreadSanitizerDeathTest, ReportsAHandOverWithTwoWriters) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(write_from_two_threads(), testing::ExitedWithCode(66), "data race");
}
#endif

TEST(LatestValue, IsEmptyUntilWrittenAndReadOnce) {
  LatestValue<int> value;
  EXPECT_FALSE(value.read_new());
  value.write(1);
  value.write(2);
  EXPECT_EQ(value.read_new(), 2);
  EXPECT_FALSE(value.read_new());
}

TEST(LatestValue, NeverTearsNeverGoesBackAndEndsWithTheLast) {
  LatestValue<Wide> value;
  std::thread writer([&] {
    for (std::uint64_t n = 1; n <= kRounds; ++n) value.write(wide(n));
  });
  std::uint64_t last = 0;
  bool good = true;
  while (good && last < kRounds) {
    if (const auto w = value.read_new()) {
      good = whole(*w) && (*w)[0] > last;
      last = (*w)[0];
    }
  }
  writer.join();
  EXPECT_TRUE(good) << "torn or old value after " << last;
}

TEST(AtomicOptional, IsNoneUntilStoredAndThenAnyNumberButItsOwnSignOfNone) {
  AtomicOptional<std::int64_t, INT64_MIN> at;
  EXPECT_EQ(at.load(), std::nullopt);
  for (const std::int64_t value : {std::int64_t{0}, std::int64_t{-1}, INT64_MIN + 1, INT64_MAX}) {
    at.store(value);
    EXPECT_EQ(at.load(), value);
  }
}

TEST(RecordRing, RefusesWhatDoesNotFitAndCountsIt) {
  RecordRing<int, 4> ring;
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(ring.push(i));
  EXPECT_FALSE(ring.push(4));
  EXPECT_EQ(ring.lost(), 1u);
  EXPECT_EQ(ring.pop(), 0);
  EXPECT_TRUE(ring.push(5));
  for (const int expected : {1, 2, 3, 5}) EXPECT_EQ(ring.pop(), expected);
  EXPECT_FALSE(ring.pop());
}

TEST(RecordRing, DeliversEveryAcceptedRecordWholeAndInOrder) {
  RecordRing<Wide, 64> ring;
  std::uint64_t accepted = 0;
  std::atomic<bool> done{false};
  std::thread writer([&] {
    for (std::uint64_t n = 1; n <= kRounds; ++n) accepted += ring.push(wide(n)) ? 1 : 0;
    done = true;
  });
  std::uint64_t last = 0, received = 0;
  bool good = true;
  for (;;) {
    const bool finished = done;
    if (const auto w = ring.pop()) {
      good = good && whole(*w) && (*w)[0] > last;
      last = (*w)[0];
      ++received;
    } else if (finished) {
      break;
    }
  }
  writer.join();
  EXPECT_TRUE(good);
  EXPECT_EQ(received, accepted);
  EXPECT_EQ(accepted + ring.lost(), kRounds);
}

// Counts its own instances: a leak or a double free shows as a wrong count.
struct Counted {
  static inline std::atomic<int> alive{0};
  explicit Counted(std::uint64_t n) : value(wide(n)) { ++alive; }
  ~Counted() {
    value = wide(0);
    --alive;
  }
  Wide value;
};

TEST(Handover, GivesWholeObjectsAndFreesEachExactlyOnce) {
  constexpr std::uint64_t kObjects = 20'000;
  {
    Handover<Counted> handover;
    std::atomic<bool> good{true}, finished{false};
    std::thread reader([&] {
      const Counted* current = nullptr;
      while (good && !(current && current->value[0] == kObjects)) {
        if (const Counted* object = handover.take()) {
          good = whole(object->value) && (!current || object->value[0] > current->value[0]);
          // Every third object is refused: it goes straight back, and the old one must still be whole.
          const bool refused = current && object->value[0] % 3 == 1 && object->value[0] != kObjects;
          handover.give_back(refused ? object : std::exchange(current, object));
        }
        if (current) good = good && whole(current->value);
      }
      handover.give_back(current);
      finished = true;
    });
    for (std::uint64_t n = 1; n <= kObjects; ++n) handover.offer(std::make_unique<const Counted>(n));
    while (!finished) handover.collect();  // frees room, so that a reader with a full ring goes on
    reader.join();
    EXPECT_TRUE(good);
  }
  EXPECT_EQ(Counted::alive, 0);
}

TEST(Handover, KeepsATakenObjectAliveUntilItIsGivenBack) {
  Handover<int> handover;
  EXPECT_EQ(handover.take(), nullptr);
  handover.offer(std::make_unique<const int>(1));
  const int* first = handover.take();
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(handover.take(), nullptr);
  handover.offer(std::make_unique<const int>(2));
  handover.offer(std::make_unique<const int>(3));
  EXPECT_EQ(*first, 1);
  const int* last = handover.take();
  EXPECT_EQ(*last, 3);
  handover.give_back(first);
  handover.give_back(last);
}

}  // namespace
}  // namespace backwash::sync
