// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/partial_watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <vector>

namespace backwash::daemon {
namespace {

using testing::HasSubstr;
constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::uint32_t kSize = 2 * dds::kLargeSample, kEach = 1344, kCount = (kSize + kEach - 1) / kEach;

struct Fragment {
  std::uint32_t first = 1;
  std::uint16_t several = 1;
  std::uint32_t size = kSize;
  std::uint8_t writer = 7, sample = 1;
  bool little = true;
  std::optional<std::size_t> bytes{};  ///< of data behind the head; none: as many as it says
};

/// A datagram of RTPS with an INFO_TS and this DATA_FRAG.
std::vector<std::uint8_t> datagram(const Fragment& f) {
  std::vector<std::uint8_t> bytes{'R', 'T', 'P', 'S', 2, 1, 1, 16};
  const auto put = [&](std::uint64_t value, int count) {
    for (int n = 0; n < count; ++n)
      bytes.push_back(static_cast<std::uint8_t>(value >> 8 * (f.little ? n : count - 1 - n)));
  };
  bytes.insert(bytes.end(), 12, f.writer);
  bytes.insert(bytes.end(), {0x09, std::uint8_t{f.little}});
  put(8, 2);
  bytes.insert(bytes.end(), 8, 0);
  bytes.insert(bytes.end(), {0x16, std::uint8_t{f.little}});
  const std::size_t data = f.bytes.value_or(std::size_t{f.several} * kEach), length = 32 + data;
  put(length < 65536 ? length : 0, 2);  // 0: to the end
  bytes.insert(bytes.end(), 8, 0);      // flags, reader
  bytes.insert(bytes.end(), {0, 0, 1, 2});
  put(0, 4);
  put(f.sample, 4);
  put(f.first, 4);
  put(f.several, 2);
  put(kEach, 2);
  put(f.size, 4);
  bytes.resize(bytes.size() + data);
  return bytes;
}

void note(const Fragment& f, std::int64_t now_ns = 0) { dds::note_fragments(datagram(f), now_ns); }

TEST(PartialSample, IsToldOfUntilEachOfItsFragmentsHasCome) {
  for (const bool little : {true, false}) {
    const std::uint8_t sample = little ? 10 : 11;
    note({.first = 2, .several = 3, .sample = sample, .little = little}, kSecond);
    note({.first = 3, .several = 1, .sample = sample, .little = little}, 2 * kSecond);  // again
    auto partial = dds::partial_sample();
    ASSERT_TRUE(partial);
    EXPECT_EQ(partial->number, sample);
    EXPECT_EQ(partial->size, kSize);
    EXPECT_EQ(partial->came, 3u);
    EXPECT_EQ(partial->count, kCount);
    EXPECT_EQ(partial->newest_ns, kSecond);
    note({.first = 1, .several = static_cast<std::uint16_t>(kCount), .sample = sample, .little = little});
    EXPECT_FALSE(dds::partial_sample());
  }
}

TEST(PartialSample, IsNoneOfBytesThatSayNonsense) {
  note({.first = 1, .several = static_cast<std::uint16_t>(kCount), .sample = 20});
  note({.first = 0, .sample = 21});
  note({.first = kCount + 1, .sample = 22});
  note({.size = dds::kLargeSample - 1, .sample = 23});
  note({.size = 0xffffffff, .sample = 24});
  auto cut = datagram({.sample = 25});
  for (std::size_t size = 0; size < cut.size(); ++size) dds::note_fragments(std::span(cut).first(size), 0);
  cut[0] = 'X';
  dds::note_fragments(cut, 0);
  EXPECT_FALSE(dds::partial_sample());
}

// Looking at a datagram must cost no more than receiving it.
TEST(PartialSample, HasNoMoreFragmentsThanADatagramHasBytesFor) {
  note({.first = 1, .sample = 30});
  note({.first = 2, .several = 1000, .sample = 30, .bytes = 2 * kEach});
  EXPECT_EQ(dds::partial_sample().value().came, 1u);
  note({.first = 2, .several = 3, .sample = 30, .bytes = 2 * kEach + 1});
  EXPECT_EQ(dds::partial_sample().value().came, 4u);
  note({.first = 1, .several = static_cast<std::uint16_t>(kCount), .sample = 30});
}

TEST(PartialSample, ThatIsLongOnItsWayIsToldAfterTenSecondsAndOnceAMinute) {
  PartialWatch watch;
  dds::Partial sample{.writer = {1}, .number = 1, .size = 20u << 20, .came = 25, .count = 100};
  std::vector<std::int64_t> told;
  for (std::int64_t now = 0; now < 200 * kSecond; now += kSecond / 10) {
    sample.newest_ns = now;
    if (const auto line = watch.look(sample, now)) {
      told.push_back(now / kSecond);
      EXPECT_THAT(*line, HasSubstr("(20.0 MiB): 25 % came in"));
      EXPECT_THAT(*line, HasSubstr("backwashctl map"));
    }
  }
  EXPECT_THAT(told, testing::ElementsAre(10, 70, 130, 190));
}

TEST(PartialSample, ThatDoesNotGoOnIsToldOnce) {
  PartialWatch watch;
  const dds::Partial sample{.writer = {1}, .number = 1, .size = 20u << 20, .came = 25, .count = 100};
  EXPECT_FALSE(watch.look(std::nullopt, 0));
  EXPECT_FALSE(watch.look(sample, 9 * kSecond));
  const auto line = watch.look(sample, 10 * kSecond);
  ASSERT_TRUE(line);
  EXPECT_THAT(*line, HasSubstr("25 % came in 0 s, then nothing"));
  EXPECT_FALSE(watch.look(sample, 500 * kSecond));
}

}  // namespace
}  // namespace backwash::daemon
