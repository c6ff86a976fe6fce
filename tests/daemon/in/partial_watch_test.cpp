// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/in/partial_watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <utility>
#include <vector>

#include "services/backwashd/in/silent_writers.hpp"

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
    const auto partial = dds::partial_samples();
    ASSERT_EQ(partial.size(), 1u);
    EXPECT_EQ(partial[0].number, sample);
    EXPECT_EQ(partial[0].size, kSize);
    EXPECT_EQ(partial[0].came, 3u);
    EXPECT_EQ(partial[0].count, kCount);
    EXPECT_EQ(partial[0].newest_ns, kSecond);
    note({.first = 1, .several = static_cast<std::uint16_t>(kCount), .sample = sample, .little = little});
    EXPECT_TRUE(dds::partial_samples().empty());
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
  EXPECT_TRUE(dds::partial_samples().empty());
}

// Looking at a datagram must cost no more than receiving it.
TEST(PartialSample, HasNoMoreFragmentsThanADatagramHasBytesFor) {
  note({.first = 1, .sample = 30});
  note({.first = 2, .several = 1000, .sample = 30, .bytes = 2 * kEach});
  EXPECT_EQ(dds::partial_samples().at(0).came, 1u);
  note({.first = 2, .several = 3, .sample = 30, .bytes = 2 * kEach + 1});
  EXPECT_EQ(dds::partial_samples().at(0).came, 4u);
  note({.first = 1, .several = static_cast<std::uint16_t>(kCount), .sample = 30});
}

void finish(Fragment f) {
  f.first = 1;
  f.several = static_cast<std::uint16_t>(kCount);
  note(f);
}

TEST(PartialSample, OfOneWriterLosesNoFragmentToAnothersThatComesMeanwhile) {
  for (std::uint32_t n = 1; n <= 10; ++n)
    for (const std::uint8_t writer : {41, 42, 43}) note({.first = n, .writer = writer, .sample = 1});
  const auto partial = dds::partial_samples();
  ASSERT_EQ(partial.size(), 3u);
  for (const dds::Partial& p : partial) EXPECT_EQ(p.came, 10u);
  for (const std::uint8_t writer : {41, 42, 43}) finish({.writer = writer, .sample = 1});
  EXPECT_TRUE(dds::partial_samples().empty());
}

TEST(PartialSample, IsTheNewestOfItsWriterAndAnOlderOnesFragmentsChangeNothing) {
  note({.first = 1, .sample = 50});
  note({.first = 1, .sample = 51});
  note({.first = 2, .sample = 51});
  note({.first = 2, .sample = 50});
  const auto partial = dds::partial_samples();
  ASSERT_EQ(partial.size(), 1u);
  EXPECT_EQ(partial[0].number, 51u);
  EXPECT_EQ(partial[0].came, 2u);
  finish({.sample = 51});
}

TEST(PartialSample, GivesItsPlaceToAnotherWritersOnceItIsTheOneThatDidNotGoOnForLongest) {
  for (std::uint8_t n = 0; n < dds::kPartialSamples; ++n)
    note({.writer = static_cast<std::uint8_t>(60 + n), .sample = 1}, (n == 2 ? 1 : 5) * kSecond);
  note({.writer = 70, .sample = 1}, 9 * kSecond);
  const auto partial = dds::partial_samples();
  ASSERT_EQ(partial.size(), dds::kPartialSamples);
  for (const dds::Partial& p : partial) EXPECT_NE(p.writer[0], 62);
  for (const std::uint8_t writer : {60, 61, 63, 70}) finish({.writer = writer, .sample = 1});
  EXPECT_TRUE(dds::partial_samples().empty());
}

TEST(PartialSample, ThatIsLongOnItsWayIsToldAfterTenSecondsAndOnceAMinute) {
  PartialWatch watch;
  dds::Partial sample{.writer = {1}, .number = 1, .size = 20u << 20, .came = 25, .count = 100};
  std::vector<std::int64_t> told;
  for (std::int64_t now = 0; now < 200 * kSecond; now += kSecond / 10) {
    sample.newest_ns = now;
    for (const std::string& line : watch.look(std::vector{sample}, now)) {
      told.push_back(now / kSecond);
      EXPECT_THAT(line, HasSubstr("(20.0 MiB): 25 % came in"));
      EXPECT_THAT(line, HasSubstr("backwashctl map"));
    }
  }
  EXPECT_THAT(told, testing::ElementsAre(10, 70, 130, 190));
}

TEST(PartialSample, ThatDoesNotGoOnIsToldOnce) {
  PartialWatch watch;
  const std::vector<dds::Partial> sample{{.writer = {1}, .number = 1, .size = 20u << 20, .came = 25, .count = 100}};
  EXPECT_TRUE(watch.look(std::vector<dds::Partial>{}, 0).empty());
  EXPECT_TRUE(watch.look(sample, 9 * kSecond).empty());
  const auto lines = watch.look(sample, 10 * kSecond);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_THAT(lines[0], HasSubstr("25 % came in 0 s, then nothing"));
  EXPECT_TRUE(watch.look(sample, 500 * kSecond).empty());
}

TEST(PartialSample, OfTwoAtATimeEachIsToldOfAtItsTime) {
  PartialWatch watch;
  std::vector<dds::Partial> samples{{.writer = {1}, .number = 1, .size = 20u << 20, .came = 25, .count = 100},
                                    {.writer = {2}, .number = 1, .size = 2u << 20, .came = 1, .count = 10}};
  std::vector<std::pair<int, std::int64_t>> told;
  for (std::int64_t now = 0; now < 75 * kSecond; now += kSecond) {
    for (auto& s : samples) s.newest_ns = now;
    samples[1].begun_ns = 3 * kSecond;
    for (const std::string& line : watch.look(samples, now))
      told.emplace_back(line.find("20.0 MiB") != line.npos ? 1 : 2, now / kSecond);
  }
  EXPECT_THAT(told, testing::ElementsAre(std::pair(1, 10), std::pair(2, 13), std::pair(1, 70), std::pair(2, 73)));
}

TEST(SilentWriters, AWriterOfWhomNoSampleComesIsToldOnceAndOthersAreNot) {
  SilentWriters silent;
  std::vector<std::pair<std::int64_t, std::string>> told;
  for (std::int64_t now = 0; now < 60 * kSecond; now += kSecond) {
    std::vector<dds::Guid> there{{1}, {2}};
    if (now >= 20 * kSecond && now < 25 * kSecond) there.push_back({3});  // gone before long
    if (now == 9 * kSecond) silent.heard({2});
    for (const std::string& line : silent.look(there, now)) told.emplace_back(now / kSecond, line);
  }
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].first, 10);
  EXPECT_THAT(told[0].second, testing::AllOf(HasSubstr("writer 01000000"), HasSubstr("backwashctl map")));
}

// Signed packets are as plain ones between two submessages more (DDS Security 1.1, 9.5.2.3).
TEST(PartialSample, IsSeenInSignedPacketsAndNotInEncryptedOnes) {
  const auto wrapped = [](std::vector<std::uint8_t> bytes, bool encrypted) {
    const auto at = bytes.begin() + 20;
    std::vector<std::uint8_t> body(at, bytes.end());
    bytes.erase(at, bytes.end());
    const std::vector<std::uint8_t> prefix{0x33, 1, 20, 0}, postfix{0x34, 1, 20, 0};
    bytes.insert(bytes.end(), prefix.begin(), prefix.end());
    bytes.resize(bytes.size() + 20);
    if (encrypted) {
      bytes.insert(bytes.end(), {0x30, 1, 0, 0});  // SEC_BODY, to the end
      for (std::uint8_t& b : body) b = static_cast<std::uint8_t>(b ^ 0x5a);
    }
    bytes.insert(bytes.end(), body.begin(), body.end());
    if (encrypted) return bytes;
    bytes.insert(bytes.end(), postfix.begin(), postfix.end());
    bytes.resize(bytes.size() + 20);
    return bytes;
  };
  Fragment f{.first = 1, .writer = 80, .sample = 1};
  dds::note_fragments(wrapped(datagram(f), true), 0);
  EXPECT_TRUE(dds::partial_samples().empty());
  dds::note_fragments(wrapped(datagram(f), false), 0);
  EXPECT_EQ(dds::partial_samples().size(), 1u);
  finish(f);
}

}  // namespace
}  // namespace backwash::daemon
