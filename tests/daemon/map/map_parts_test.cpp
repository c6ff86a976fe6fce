// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <random>
#include <thread>

#include "services/backwashd/channels.hpp"
#include "services/backwashd/map/map_front.hpp"
#include "services/backwashd/map/map_parts.hpp"
#include "services/dds/map_sending.hpp"
#include "tests/daemon/map/map_in_parts.hpp"

namespace backwash::daemon {
namespace {

using testing::HasSubstr;

TEST(MapParts, APartThatIsNoneOfItsMapIsRefused) {
  Map map(3000);
  MapParts parts(1u << 20, "map");
  const auto refused = [&](auto&& change) {
    dds::MapPart part = map.of(1, 1);
    change(part);
    const auto taken = parts.take(part, kOne, kSecond);
    return taken ? "taken" : taken.error();
  };
  EXPECT_THAT(refused([](auto& p) { p.size = (1u << 20) + 1; }), HasSubstr("at most 1048576"));
  EXPECT_THAT(refused([](auto& p) { p.size = 0; }), HasSubstr("at least 1"));
  EXPECT_THAT(refused([](auto& p) {
                p.number = 3;
                p.data._length = 3000 - 2 * dds::kPartBytes;
              }),
              HasSubstr("part 3"));
  EXPECT_THAT(refused([](auto& p) { p.data._length = 1151; }), HasSubstr("has 1151"));
  const std::string odom = "odom";
  EXPECT_THAT(refused([&](auto& p) { p.frame_id = dds::c_string(odom); }), HasSubstr("'map'"));
  map.part.transfer = 8;
  ASSERT_TRUE(parts.take(map.of(0, 1), kOne, kSecond));
  EXPECT_THAT(refused([](auto& p) { ++p.hash; }), HasSubstr("differs from the others"));
}

TEST(MapParts, OneMapArrivesAtATimeUntilItsSenderIsSilent) {
  Map map(3000), next(3000);
  next.part.transfer = 8;
  MapParts parts(1u << 20, "map");
  ASSERT_TRUE(parts.take(map.of(0, 1), kOne, 0));
  EXPECT_FALSE(parts.take(next.of(0, 1), kAnother, MapParts::kYield_ns - 1));
  EXPECT_FALSE(parts.stalled(MapParts::kYield_ns));
  EXPECT_TRUE(parts.take(next.of(0, 1), kAnother, MapParts::kYield_ns));
  const auto line = parts.stalled(MapParts::kYield_ns);
  ASSERT_TRUE(line);
  EXPECT_THAT(*line, HasSubstr("1 of 3 parts came in 0 s, and another began in its place"));
  EXPECT_FALSE(parts.stalled(MapParts::kYield_ns));
}

TEST(MapParts, WhoOnlyRepeatsAPartHoldsItsPlaceNoLonger) {
  Map map(3000), next(3000);
  next.part.transfer = 8;
  MapParts parts(1u << 20, "map");
  ASSERT_TRUE(parts.take(map.of(0, 1), kOne, 0));
  std::int64_t now = 0;
  for (; now < MapParts::kYield_ns; now += 10 * kMs) ASSERT_TRUE(parts.take(map.of(0, now), kOne, now));
  EXPECT_EQ(*parts.take(next.of(0, 1), kAnother, now), MapParts::Taken::begins);
  // The operator is told of it, and what came is let go.
  MapParts alone(1u << 20, "map");
  ASSERT_TRUE(alone.take(map.of(0, 1), kOne, 0));
  std::vector<std::int64_t> told;
  for (now = 0; now < 65 * kSecond; now += 100 * kMs) {
    if (now <= MapParts::kForget_ns) {
      ASSERT_TRUE(alone.take(map.of(0, now), kOne, now));
    }
    if (alone.stalled(now)) told.push_back(now / kSecond);
  }
  EXPECT_EQ(told, std::vector<std::int64_t>{10});
  EXPECT_EQ(*alone.take(map.of(1, now), kOne, now), MapParts::Taken::begins);
}

TEST(MapParts, AWholeMapIsNotDisplacedBeforeItsSenderKnowsWhatBecameOfIt) {
  Map map(1000), next(3000);
  next.part.transfer = 8;
  MapParts parts(1u << 20, "map");
  ASSERT_EQ(*parts.take(map.of(0, 1), kOne, 0), MapParts::Taken::whole);
  EXPECT_FALSE(parts.take(next.of(0, 1), kAnother, kSecond));
  ASSERT_EQ(*parts.take(map.of(0, 2), kOne, 2 * kSecond), MapParts::Taken::here) << "it asks";
  EXPECT_FALSE(parts.take(next.of(0, 2), kAnother, 3 * kSecond));
  parts.judge({7, true, {}});
  const auto receipt = parts.receipt(4 * kSecond);
  ASSERT_TRUE(receipt);
  EXPECT_EQ(receipt->transfer, 7u);
  EXPECT_EQ(receipt->state, backwash_msgs_msg_dds__MAPRECEIPT_ACCEPTED);
  EXPECT_EQ(*parts.take(next.of(0, 3), kAnother, 4 * kSecond), MapParts::Taken::begins);
}

// The map worker is never given it, and says nothing of it: its sender would wait for as long as it is answered.
TEST(MapParts, AMapThatANewerOneReplacedBeforeItWasLookedAtIsRefusedInItsReceipts) {
  Map map(1000);
  MapParts parts(1u << 20, "map");
  sync::Handover<MapMessage> maps;
  const auto offer = [&](MapMessage message) {
    const auto before = maps.offer(std::make_unique<const MapMessage>(std::move(message)));
    parts.displaced(before.get());
  };
  offer({});
  ASSERT_EQ(*parts.take(map.of(0, 1), kOne, 0), MapParts::Taken::whole);
  offer(parts.message());
  EXPECT_EQ(parts.receipt(kSecond)->state, backwash_msgs_msg_dds__MAPRECEIPT_WHOLE);
  MapMessage other;
  other.transfer = 6;
  parts.displaced(&other);
  EXPECT_FALSE(parts.receipt(2 * kSecond)) << "of another transfer";
  offer({});
  const auto receipt = parts.receipt(2 * kSecond);
  ASSERT_TRUE(receipt);
  EXPECT_EQ(receipt->state, backwash_msgs_msg_dds__MAPRECEIPT_REFUSED);
  EXPECT_THAT(receipt->reason, HasSubstr("a newer map came"));
  // One that the worker has taken is judged by it.
  ASSERT_EQ(*parts.take((map.part.transfer = 8, map.of(0, 1)), kOne, 3 * kSecond), MapParts::Taken::whole);
  offer(parts.message());
  const MapMessage* taken = maps.take();
  offer({});
  EXPECT_EQ(parts.receipt(4 * kSecond)->state, backwash_msgs_msg_dds__MAPRECEIPT_WHOLE);
  maps.give_back(taken);
}

// Its sender asks again when maps are taken from another writer by then, or sends a part that is none.
TEST(MapParts, AMapThatIsWholeHasTheVerdictOfTheMapWorkerAlone) {
  for (const bool judged : {true, false}) {
    Map map(1000);
    MapParts parts(1u << 20, "map");
    ASSERT_EQ(*parts.take(map.of(0, 1), kOne, 0), MapParts::Taken::whole);
    if (judged) parts.judge({7, true, {}});
    parts.refuse(map.of(0, 2), kOne, "maps are taken from another writer", kMs);
    EXPECT_FALSE(parts.take(map.of(1, 3), kOne, 2 * kMs)) << "there is no such part";
    if (!judged) {
      EXPECT_EQ(parts.receipt(kSecond)->state, backwash_msgs_msg_dds__MAPRECEIPT_WHOLE);
      parts.judge({7, true, {}});
    }
    EXPECT_EQ(parts.receipt(2 * kSecond)->state, backwash_msgs_msg_dds__MAPRECEIPT_ACCEPTED);
  }
}

TEST(MapParts, AWriterThatBeginsAMapWithEachPartTakesMemoryOnceASecond) {
  Map map(3000);
  MapParts parts(1u << 20, "map");
  int begun = 0;
  for (std::int64_t now = 0; now < 3 * kSecond; now += 10 * kMs, ++map.part.transfer)
    if (const auto taken = parts.take(map.of(0, now), kOne, now)) begun += *taken == MapParts::Taken::begins;
  EXPECT_EQ(begun, 3);
}

TEST(MapParts, TheOperatorIsToldOnceOfAMapThatDoesNotGoOn) {
  Map map(3000);
  MapParts parts(1u << 20, "map");
  ASSERT_TRUE(parts.take(map.of(1, 1), kOne, 0));
  EXPECT_FALSE(parts.stalled(MapParts::kSilent_ns - 1));
  const auto line = parts.stalled(MapParts::kSilent_ns);
  ASSERT_TRUE(line);
  EXPECT_THAT(*line, HasSubstr("1 of 3 parts came"));
  EXPECT_FALSE(parts.stalled(MapParts::kSilent_ns + 1));
  // It may go on, and is told of again.
  ASSERT_TRUE(parts.take(map.of(0, 2), kOne, 15 * kSecond));
  EXPECT_TRUE(parts.stalled(26 * kSecond));
  EXPECT_FALSE(parts.stalled(90 * kSecond));
  EXPECT_EQ(*parts.take(map.of(0, 3), kOne, 91 * kSecond), MapParts::Taken::begins);  // what came was let go
}

TEST(MapParts, AMapWhoseSenderIsGoneMakesRoomAtOnceAndIsTold) {
  Map map(3000), next(3000);
  next.part.transfer = 8;
  MapParts parts(1u << 20, "map");
  ASSERT_TRUE(parts.take(map.of(1, 1), kOne, 0));
  EXPECT_FALSE(parts.let_go(std::vector{kAnother}));
  const auto line = parts.let_go(std::vector{kAnother, kOne});
  ASSERT_TRUE(line);
  EXPECT_THAT(*line, HasSubstr("1 of 3 parts came in 0 s, and its sender is gone"));
  EXPECT_FALSE(parts.let_go(std::vector{kOne}));
  EXPECT_EQ(*parts.take(next.of(0, 1), kAnother, 1), MapParts::Taken::begins);
}

TEST(MapParts, AMapThatArrivesDamagedIsRefusedInItsReceipts) {
  Map map(3000);
  ++map.data[5];
  MapParts parts(1u << 20, "map");
  ASSERT_TRUE(parts.take(map.of(0, 1), kOne, 0));
  ASSERT_TRUE(parts.take(map.of(1, 2), kOne, 0));
  EXPECT_FALSE(parts.take(map.of(2, 3), kOne, 0));
  const auto receipt = parts.receipt(kSecond);
  ASSERT_TRUE(receipt);
  EXPECT_EQ(receipt->state, backwash_msgs_msg_dds__MAPRECEIPT_REFUSED);
  EXPECT_THAT(receipt->reason, HasSubstr("differs from what was sent"));
}

TEST(MapParts, TheVerdictOfTheMapWorkerGoesIntoTheReceipts) {
  for (const bool good : {true, false}) {
    Map map(1000);
    MapParts parts(1u << 20, "map");
    ASSERT_EQ(*parts.take(map.of(0, 1), kOne, 0), MapParts::Taken::whole);
    EXPECT_EQ(parts.receipt(kSecond)->state, backwash_msgs_msg_dds__MAPRECEIPT_WHOLE);
    EXPECT_FALSE(parts.receipt(2 * kSecond));  // nothing new
    MapVerdict verdict{7, good, {}};
    std::snprintf(verdict.why.data(), verdict.why.size(), "%s", good ? "" : "it has no free voxel");
    parts.judge({6, !good, {}});  // of another map
    EXPECT_FALSE(parts.receipt(2 * kSecond));
    parts.judge(verdict);
    const auto receipt = parts.receipt(3 * kSecond);
    ASSERT_TRUE(receipt);
    EXPECT_EQ(receipt->state,
              good ? backwash_msgs_msg_dds__MAPRECEIPT_ACCEPTED : backwash_msgs_msg_dds__MAPRECEIPT_REFUSED);
    EXPECT_STREQ(receipt->reason, good ? "" : "it has no free voxel");
  }
}

// The reader's thread of the daemon itself, with nobody who looks at maps: a whole map takes the place of one in parts.
TEST(MapFront, TellsTheSenderOfPartsThatANewerWholeMapTookItsPlace) {
  config::Daemon config;
  config.dds.domain = 1 + ::getpid() % 200;
  config.dds.interface = "lo";
  config.dds.name_space = "backwash";
  const std::string log = testing::TempDir() + "map_front." + std::to_string(::getpid());
  Channels channels;
  Recorder recorder(log);
  MapFront front(config, 0, channels, recorder);
  std::jthread reader([&] { front.run_readers(); });
  const dds::Participant sender(static_cast<std::uint32_t>(config.dds.domain), "lo");
  auto parts = dds::make_writer<dds::MapPart>(sender, "backwash");
  auto wholes = dds::make_writer<dds::Octomap>(sender, "backwash");
  auto receipts = dds::make_reader<dds::MapReceipt>(sender, "backwash");
  Map map(1000);
  std::optional<std::uint8_t> state;
  std::string why;
  const auto until = [&](std::uint8_t wanted, const auto& again) {
    for (int n = 0; n < 200 && state != wanted; ++n) {
      again();
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      receipts.take([&](const dds::MapReceipt& receipt) {
        state = receipt.state;
        why = receipt.reason;
      });
    }
    return state == wanted;
  };
  EXPECT_TRUE(until(backwash_msgs_msg_dds__MAPRECEIPT_WHOLE, [&] { parts.write(map.of(0, 1)); }));
  dds::Octomap whole{};
  whole.header.frame_id = dds::c_string(map.frame);
  whole.id = dds::c_string(map.id);
  EXPECT_TRUE(until(backwash_msgs_msg_dds__MAPRECEIPT_REFUSED, [&] { wholes.write(whole); }));
  EXPECT_THAT(why, HasSubstr("a newer map came before this one was looked at"));
  channels.stop = true;
  reader.join();
  std::filesystem::remove(log);
}

// Maps in parts over lines that are simulated here, in their own time (docs/interfaces.md, "Maps in parts").

constexpr double kOnLine = 1310;  // byte of a part on the line: its data, the message, RTPS, UDP and IP

struct RadioLine {
  double rate = 125e3;  ///< byte/s
  double queue_s = 0.5, loss = 0.3;
  std::int64_t least_ns = 50 * kMs, most_ns = 100 * kMs;
  double dead_after_s = 1e9;
};

struct Sent {
  double took_s = 0, waited_s = 0;  ///< until the map was whole; in the line's queue, of nine parts in ten at most
  double often = 0;                 ///< times that a part was sent, on average
  std::uint32_t held = 0;
  std::int64_t silent_ns = 0;
  MapMessage message;
};

/// A map over a line until it is whole, or for `until_s`.
class Flight {
 public:
  Flight(const RadioLine& line, std::size_t size, double most = 12.5e6)
      : line_(line), map_(size), sending_(size, most, 0) {}

  Sent run(double until_s) {
    std::int64_t now = 0;
    Sent sent;
    for (; !whole_ && seconds(now) < until_s; now += kMs) {
      while (const auto number = sending_.next(now)) offer(*number, now);
      for (; !there_.empty() && there_.begin()->first <= now; there_.erase(there_.begin()))
        take(there_.begin()->second, now);
      if (const auto receipt = parts_.receipt(now); receipt && !is_lost(now)) answer(*receipt, now);
      for (; !back_.empty() && back_.begin()->first <= now; back_.erase(back_.begin()))
        hear(back_.begin()->second, now);
    }
    std::ranges::sort(waits_);
    sent.took_s = seconds(now);
    sent.waited_s = waits_.empty() ? 0 : waits_[waits_.size() * 9 / 10];
    sent.often = static_cast<double>(sending_.sent()) / sending_.count();
    sent.held = sending_.held();
    sent.silent_ns = now - sending_.progress_ns();
    if (whole_) sent.message = parts_.message();
    return sent;
  }
  bool whole() const { return whole_; }
  const std::vector<std::uint8_t>& data() const { return map_.data; }

 private:
  struct Answer {
    dds::MapReceipt receipt;
    std::vector<std::uint8_t> beyond;
  };
  bool is_lost(std::int64_t now) {
    return seconds(now) > line_.dead_after_s || std::bernoulli_distribution(line_.loss)(random_);
  }
  std::int64_t delay() { return std::uniform_int_distribution(line_.least_ns, line_.most_ns)(random_); }
  void offer(std::uint32_t number, std::int64_t now) {
    const double start = std::max(free_s_, seconds(now)), waits = start - seconds(now);
    if (waits > line_.queue_s) return;
    waits_.push_back(waits);
    free_s_ = start + kOnLine / line_.rate;
    if (!is_lost(now)) there_.emplace(static_cast<std::int64_t>(free_s_ * 1e9) + delay(), std::pair(number, now));
  }
  void take(std::pair<std::uint32_t, std::int64_t> part, std::int64_t now) {
    const auto taken = parts_.take(map_.of(part.first, part.second), kOne, now);
    ASSERT_TRUE(taken) << taken.error();
    whole_ = whole_ || *taken == MapParts::Taken::whole;
  }
  void answer(const dds::MapReceipt& receipt, std::int64_t now) {
    const auto* first = receipt.beyond._buffer;
    back_.emplace(now + delay(), Answer{receipt, {first, first + receipt.beyond._length}});
  }
  void hear(Answer& answer, std::int64_t now) {
    answer.receipt.beyond._buffer = answer.beyond.data();
    sending_.hear(answer.receipt, now);
  }

  RadioLine line_;
  Map map_;
  dds::MapSending sending_;
  MapParts parts_{48u << 20, "map"};
  std::mt19937 random_{3};
  double free_s_ = 0;
  std::vector<double> waits_;
  std::multimap<std::int64_t, std::pair<std::uint32_t, std::int64_t>> there_;
  std::multimap<std::int64_t, Answer> back_;
  bool whole_ = false;
};

/// s that a map of so many bytes needs on this line if no part is sent but those that were lost.
double least_s(const RadioLine& line, std::size_t size) {
  return dds::parts_of(size) * kOnLine / line.rate / (1 - line.loss);
}

TEST(MapParts, TwentyMebibytesArriveOverALineOfOneMegabitThatLosesThreeInTen) {
  const RadioLine line;
  Flight flight(line, 20u << 20);
  const Sent sent = flight.run(600);
  ASSERT_TRUE(flight.whole()) << sent.held << " parts in " << sent.took_s << " s";
  RecordProperty("took_s", std::to_string(sent.took_s));
  std::printf("%.0f s, at least %.0f; each part %.2f times; nine in ten wait for %.2f s\n", sent.took_s,
              least_s(line, 20u << 20), sent.often, sent.waited_s);
  EXPECT_LT(sent.took_s, 1.25 * least_s(line, 20u << 20));
  EXPECT_GT(sent.took_s, least_s(line, 20u << 20) * 0.98);
  EXPECT_LT(sent.often, 1.15 / (1 - line.loss));  // what is here is not sent again
  EXPECT_LT(sent.waited_s, 0.4);                  // so long a command on the same line waits
  EXPECT_TRUE(std::ranges::equal(sent.message.data, flight.data(),
                                 [](std::int8_t a, std::uint8_t b) { return static_cast<std::uint8_t>(a) == b; }));
  EXPECT_EQ(sent.message.transfer, 7u);
}

TEST(MapParts, ALineWithoutLossIsFilledAndNothingIsSentTwice) {
  for (const double rate : {125e3, 12.5e6}) {
    const RadioLine line{.rate = rate, .loss = 0, .least_ns = kMs, .most_ns = 2 * kMs};
    Flight flight(line, 8u << 20);
    const Sent sent = flight.run(300);
    ASSERT_TRUE(flight.whole());
    EXPECT_LT(sent.took_s, 1.25 * least_s(line, 8u << 20) + 5) << rate;
    EXPECT_LT(sent.often, 1.05) << rate;
  }
}

TEST(MapParts, ALineWithoutAQueueLosesAtMostEveryOtherPartToTheRate) {
  const RadioLine line{.queue_s = 0.02, .loss = 0};
  Flight flight(line, 2u << 20);
  const Sent sent = flight.run(300);
  ASSERT_TRUE(flight.whole());
  EXPECT_LT(sent.took_s, 1.5 * least_s(line, 2u << 20));
  EXPECT_LT(sent.often, 2.2);
}

TEST(MapParts, TheGivenRateIsNeverExceeded) {
  const RadioLine line{.rate = 12.5e6, .loss = 0, .least_ns = kMs, .most_ns = kMs};
  Flight flight(line, 1u << 20, 50e3);
  const Sent sent = flight.run(300);
  ASSERT_TRUE(flight.whole());
  EXPECT_GT(sent.took_s, (1u << 20) / 50e3);
}

TEST(MapParts, ALineThatDiesIsNoticedByTheSenderAndSendsLittleMore) {
  const RadioLine line{.dead_after_s = 30};
  Flight flight(line, 20u << 20);
  const Sent sent = flight.run(60);
  EXPECT_FALSE(flight.whole());
  EXPECT_GT(sent.silent_ns, 28 * kSecond);
  EXPECT_GT(sent.held, 1000u);
  EXPECT_LT(sent.often * dds::parts_of(20u << 20), sent.held / 0.6 + 700);
}

TEST(MapParts, ReceiptsThatNoDaemonCanHaveMeantChangeNothing) {
  dds::MapSending sending(10 * dds::kPartBytes, 1e6, 0);
  ASSERT_TRUE(sending.next(kMs));
  std::array<std::uint8_t, 2> all{0xff, 0xff};
  for (auto [first, newest] :
       {std::pair(5u, std::int64_t{1}), std::pair(0u, kSecond), std::pair(0u, std::int64_t{-1})}) {
    dds::MapReceipt receipt{};
    receipt.first_missing = first;
    receipt.newest = static_cast<std::uint64_t>(newest);
    receipt.beyond = {2, 2, all.data(), false};
    sending.hear(receipt, 2 * kMs);
    EXPECT_EQ(sending.held(), 0u) << first << " " << newest;
  }
}

// It restarted, or heard nothing for a minute.
TEST(MapParts, WhatADaemonNoLongerHasIsSentAgain) {
  Map map(5 * dds::kPartBytes);
  dds::MapSending sending(map.data.size(), 1e6, 0);
  std::int64_t now = 0;
  const auto whole_at = [&](MapParts& parts, std::int64_t until) {
    for (; now < until; now += kMs) {
      while (const auto number = sending.next(now))
        if (parts.take(map.of(*number, now), kOne, now) == MapParts::Taken::whole) return true;
      if (const auto receipt = parts.receipt(now)) sending.hear(*receipt, now);
    }
    return false;
  };
  MapParts before(1u << 20, "map"), after(1u << 20, "map");
  ASSERT_FALSE(whole_at(before, 105 * kMs));
  ASSERT_GT(sending.held(), 1u);
  EXPECT_TRUE(whole_at(after, 20 * kSecond));
}

TEST(MapParts, OnceAllIsHereTheSenderAsksForTheVerdictUntilItComes) {
  dds::MapSending sending(2 * dds::kPartBytes, 1e6, 0);
  ASSERT_TRUE(sending.next(kMs) && sending.next(100 * kMs));
  dds::MapReceipt receipt{};
  receipt.first_missing = 2;
  sending.hear(receipt, 110 * kMs);
  ASSERT_EQ(sending.held(), 2u);
  int asked = 0;
  for (std::int64_t now = 110 * kMs; now < 2 * kSecond; now += kMs) asked += sending.next(now).has_value();
  EXPECT_EQ(asked, 6);
}

}  // namespace
}  // namespace backwash::daemon
