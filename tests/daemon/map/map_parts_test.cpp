// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/map/map_parts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <thread>

#include "services/backwashd/channels.hpp"
#include "services/backwashd/map/map_front.hpp"
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
  EXPECT_FALSE(parts.take(next.of(0, 1), kOther, MapParts::kYield_ns - 1));
  EXPECT_FALSE(parts.stalled(MapParts::kYield_ns));
  EXPECT_TRUE(parts.take(next.of(0, 1), kOther, MapParts::kYield_ns));
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
  EXPECT_EQ(*parts.take(next.of(0, 1), kOther, now), MapParts::Taken::begins);
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
  EXPECT_FALSE(parts.take(next.of(0, 1), kOther, kSecond));
  ASSERT_EQ(*parts.take(map.of(0, 2), kOne, 2 * kSecond), MapParts::Taken::here) << "it asks";
  EXPECT_FALSE(parts.take(next.of(0, 2), kOther, 3 * kSecond));
  parts.judge({7, true, {}});
  const auto receipt = parts.receipt(4 * kSecond);
  ASSERT_TRUE(receipt);
  EXPECT_EQ(receipt->transfer, 7u);
  EXPECT_EQ(receipt->state, backwash_msgs_msg_dds__MAPRECEIPT_ACCEPTED);
  EXPECT_EQ(*parts.take(next.of(0, 3), kOther, 4 * kSecond), MapParts::Taken::begins);
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
  EXPECT_FALSE(parts.let_go(std::vector{kOther}));
  const auto line = parts.let_go(std::vector{kOther, kOne});
  ASSERT_TRUE(line);
  EXPECT_THAT(*line, HasSubstr("1 of 3 parts came in 0 s, and its sender is gone"));
  EXPECT_FALSE(parts.let_go(std::vector{kOne}));
  EXPECT_EQ(*parts.take(next.of(0, 1), kOther, 1), MapParts::Taken::begins);
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
  MapFront front(config, channels, recorder);
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

}  // namespace
}  // namespace backwash::daemon
