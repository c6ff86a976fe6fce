// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "services/backwashd/in/allowance.hpp"
#include "tests/daemon/in/strangers_rig.hpp"

namespace backwash::dds {
namespace {

using namespace packets;

TEST(Door, OneWhoIsSilentForALeaseIsAStrangerAgain) {
  Gate gate;
  EXPECT_TRUE(gate.lets_in(1));
  gate.rest(Door::kLease_s - 1);
  EXPECT_TRUE(gate.hears(1)) << "and that was a sign of life";
  gate.rest(Door::kLease_s - 1);
  EXPECT_TRUE(gate.hears(1));
  gate.rest(Door::kLease_s + 1);
  EXPECT_FALSE(gate.hears(1));
  EXPECT_TRUE(gate.lets_in(1));
}

// Whoever shares a computer with the flood shares its address.
TEST(Door, AFloodFromOneSocketKeepsNobodyElseOut) {
  Gate gate;
  std::uint32_t in = 0;
  for (std::uint32_t n = 0; n < 60'000; ++n, gate.now_ns += 1'000'000) {
    in += gate.lets_in(1000 + n);
    if (n % 1'000 == 0) {
      ASSERT_TRUE(gate.lets_in(n / 1'000, socket(1 + n / 1'000))) << n;
    }
  }
  EXPECT_LE(in, Door::kFirstOfSocket);
  EXPECT_LE(gate.door->living(gate.now_ns), Door::kOfSocket + 40u);
}

// However long the flood was, and although it announces itself all the while.
TEST(Door, WhoeverGetsAPortOfAFloodWaitsAMinute) {
  Gate gate;
  for (std::uint32_t n = 0; n < 10'000; ++n, gate.now_ns += 1'000'000) gate.lets_in(1000 + n);
  EXPECT_TRUE(gate.lets_in(2, socket(1))) << "from a port of its own";
  int waited_s = 0;
  for (; !gate.lets_in(1) && waited_s < 1000; ++waited_s) gate.rest(1);
  EXPECT_NEAR(waited_s, 60, 1);
}

// As long as its sockets are fewer than its announcements.
TEST(Door, AFloodFromManySocketsOfAnAddressKeepsNobodyElseOut) {
  Gate gate;
  std::uint32_t in = 0;
  for (std::uint32_t n = 0; n < 60'000; ++n, gate.now_ns += 1'000'000) {
    in += gate.lets_in(1000 + n, socket(n % 500));
    if (n < 20'000 || n % 1'000 != 0) continue;
    ASSERT_TRUE(gate.lets_in(n / 1'000, socket(30'000 + n / 1'000))) << n;
    ASSERT_TRUE(gate.lets_in(500 + n / 1'000, address(n / 1'000))) << n;
  }
  EXPECT_LE(in, Door::kFirstOfAddress + 60 * Door::kNewOfAddress + 1);
}

// Nor whose sum is one of theirs.
TEST(Door, AFloodFromManySocketsKeepsNoSocketOut) {
  Gate gate;
  for (std::uint32_t n = 0; n < 400'000; ++n, gate.now_ns += 1'000'000) {
    gate.lets_in(10'000 + n, socket(n % 500));
    if (n % 500 == 0 && n >= 20'000) {
      ASSERT_TRUE(gate.lets_in(n / 500, socket(1'000 + n / 500))) << n;
    }
  }
}

TEST(Door, AFloodFromOneAddressKeepsNoOtherAddressOut) {
  Gate gate;
  std::uint32_t in = 0;
  for (std::uint32_t n = 0; n < 10'000; ++n, gate.now_ns += 1'000'000) {
    in += gate.lets_in(1000 + n, socket(n));
    if (n % 1'000 == 0) {
      ASSERT_TRUE(gate.lets_in(n / 1'000, address(n / 1'000))) << n;
    }
  }
  EXPECT_LE(in, Door::kFirstOfAddress + 10 * Door::kNewOfAddress + 1);
}

TEST(Door, AFloodFromEverywhereLetsInSoManyASecondAndPushesOutNobodyWhoIsConnected) {
  Gate gate;
  std::uint32_t in = 0;
  for (std::uint32_t who = 0; who < 8; ++who) {
    EXPECT_TRUE(gate.lets_in(who, address(who)));
    if (who % 2 == 0) gate.meet(who);
  }
  for (std::uint32_t n = 0; n < 60'000; ++n, gate.now_ns += 1'000'000) {
    in += gate.lets_in(1000 + n, address(n));
    for (std::uint32_t who = 0; n % 1'000 == 0 && who < 8; who += 2)
      ASSERT_TRUE(gate.hears(who)) << who << " after " << n;
  }
  EXPECT_LE(in, Door::kFirst + 60 * Door::kNew + 1);
  EXPECT_EQ(gate.door->living(gate.now_ns), Door::kLiving);
  for (std::uint32_t who = 1; who < 8; who += 2) EXPECT_FALSE(gate.hears(who)) << "it was the first stranger";
  gate.meet(1);
  EXPECT_TRUE(gate.hears(1)) << "the middleware vouches for it";
}

TEST(Door, WhereAllAreConnectedWhoeverIsSilentGoesFirst) {
  Gate gate;
  for (std::uint32_t who = 0; who < Door::kLiving; ++who) gate.meet(who);
  gate.rest(5);
  EXPECT_FALSE(gate.lets_in(500, address(500))) << "nobody is silent for long";
  gate.rest(Door::kSilent_s);
  for (std::uint32_t who = 1; who < Door::kLiving; ++who) EXPECT_TRUE(gate.hears(who));
  EXPECT_TRUE(gate.lets_in(500, address(500)));
  EXPECT_FALSE(gate.hears(0));
}

TEST(Door, WhoeverIsOfThisProcessIsKnownUntilItIsGone) {
  Gate gate;
  gate.door->ours(Door::Prefix(prefix(1).data(), 12), gate.now_ns);
  gate.rest(1e6);
  EXPECT_TRUE(gate.hears(1));
  gate.door->gone(Door::Prefix(prefix(1).data(), 12));
  EXPECT_FALSE(gate.hears(1));
}

TEST(Door, AnnouncementsOfOneAreCounted) {
  Gate gate;
  int in = 0;
  for (int n = 0; n < 10'000; ++n, gate.now_ns += 100'000) in += gate.lets_in(1);
  EXPECT_LE(in, 1 + Door::kAgainFirst + Door::kAgain + 1);
  EXPECT_TRUE(gate.hears(1));
}

TEST(Door, EndpointsOfOneAreCountedAndWhatIsGoneMakesRoom) {
  Gate gate;
  ASSERT_TRUE(gate.lets_in(1));
  gate.meet(1);
  EXPECT_FALSE(*gate.endpoint(1, 9999, false, {{0x05, kTopic}, {0x2c, Packet(5000)}})) << "more than an endpoint says";
  EXPECT_TRUE(gate.endpoint(1, 9999, true));
  for (std::uint32_t n = 0; n < 1000; ++n) EXPECT_EQ(*gate.endpoint(1, n), n < Door::kEndpointsOfOne) << n;
  EXPECT_TRUE(*gate.endpoint(1, 5)) << "again";
  EXPECT_TRUE(*gate.endpoint(1, 5, true) && *gate.endpoint(1, 1000));
  EXPECT_FALSE(*gate.endpoint(1, 5));
}

// A ROS 2 system of any size: the middleware leaves out what has no topic.
TEST(Door, EndpointsOfTopicsThatAreNotOursAreNotCounted) {
  Gate gate;
  const auto text = [](const std::string& name) {
    Packet p = number(static_cast<std::uint32_t>(name.size() + 1), 4);
    p.insert(p.end(), name.begin(), name.end());
    p.resize((p.size() + 4) / 4 * 4);
    return p;
  };
  for (std::uint32_t who = 0; who < 8; ++who) {
    ASSERT_TRUE(gate.lets_in(who));
    for (std::uint32_t n = 0; n < 1500; ++n) {
      const std::string other = n == 0 ? "" : n == 1 ? "rt/abc" : n == 2 ? "rt/abcde" : "rt/other" + std::to_string(n);
      ASSERT_FALSE(*gate.endpoint(who, n, false, {{0x05, text(other)}})) << other;
      for (std::uint32_t all = 0; n % 500 == 0 && all <= who; ++all) ASSERT_TRUE(gate.hears(all)) << all;
    }
    for (std::uint32_t n = 1500; n < 1500 + Door::kShared / 8; ++n) ASSERT_TRUE(*gate.endpoint(who, n)) << n;
  }
  EXPECT_FALSE(*gate.endpoint(7, 2, false, {{0x05, number(400, 4)}})) << "of no length";
  EXPECT_TRUE(*gate.endpoint(7, 2, false, {{0x05, kTopic}, {0x05, text("rt/other")}})) << "of both";
  EXPECT_TRUE(*gate.endpoint(7, 3, false, {{0x05, text(std::string("rt/abcd\0rt", 10))}})) << "read to its first zero";
  gate.door->wants(std::vector<std::string>());
  EXPECT_TRUE(*gate.endpoint(7, 4, false, {{0x05, text("rt/other")}})) << "a participant that may have any topic";
}

TEST(Door, EachParticipantHasAPlaceForItsFirstEndpointsAndNoneIsLost) {
  Gate gate;
  for (std::uint32_t who = 0; who < 20; ++who) {
    ASSERT_TRUE(gate.lets_in(who, socket(who)));
    gate.meet(who);
  }
  std::size_t all = 0;
  for (std::uint32_t who = 0; who < 9; ++who)
    for (std::uint32_t n = 0; n < 140; ++n) all += gate.endpoint(who, n).value_or(false);
  EXPECT_EQ(all, 9 * Door::kSureOfOne + Door::kShared);
  const std::uint32_t more = Door::kSureOfOne;
  for (std::uint32_t who = 10; who < 20; ++who)
    for (std::uint32_t n = 0; n <= more; ++n) EXPECT_EQ(gate.endpoint(who, n).has_value(), n < more) << who << ' ' << n;
  EXPECT_TRUE(*gate.endpoint(0, 3, true));
  EXPECT_TRUE(*gate.endpoint(15, more)) << "it came again";
}

// Until its lease is over the middleware still has them.
TEST(Door, EndpointsOfWhoeverLostItsPlaceAreCountedOn) {
  Gate gate;
  std::size_t all = 0;
  std::uint32_t who = 0;
  for (const std::int64_t end = gate.now_ns + (Door::kLease_s - 1) * Door::kSecond_ns; gate.now_ns < end; ++who) {
    if (who >= Door::kFirstOfAddress) gate.rest(0.34);
    ASSERT_TRUE(gate.lets_in(who, socket(who))) << who;
    const std::int64_t now_ns = gate.now_ns;
    for (std::uint32_t n = 0; n < 16; ++n) all += gate.endpoint(who, n).value_or(false);
    gate.now_ns = now_ns;
  }
  EXPECT_GT(who * 16, Door::kEndpoints) << "more than there is room for";
  EXPECT_EQ(gate.door->living(gate.now_ns), Door::kOfAddress);
  EXPECT_EQ(all, Door::kEndpoints);
  EXPECT_FALSE(gate.endpoint(who - 1, 15)) << "to come again";
  gate.rest(2);
  EXPECT_TRUE(*gate.endpoint(who - 1, 15)) << "the leases of the first are over";
}

// What comes out of order is kept until the rest is there.
TEST(Door, DiscoveryOfStrangersIsCountedInBytes) {
  Gate gate;
  std::size_t bytes = 0;
  for (std::uint32_t who = 0; who < 40; ++who) ASSERT_TRUE(gate.lets_in(who, socket(who)));
  for (std::uint32_t n = 0; n < 60'000; ++n, gate.now_ns += 1'000'000) {
    const Packet large = data(kMessages, whole({guid(n % 40, 0), Packet(20'000)}, {0, 1, 0, 0}));
    if (gate.passes(n % 40, large)) bytes += large.size();
  }
  EXPECT_GT(bytes, 1u << 20);
  EXPECT_LE(bytes, static_cast<std::size_t>(Door::kFirstBytesOfStrangers + 60 * Door::kBytesOfStrangers));
  EXPECT_TRUE(gate.hears(1));
}

// The middleware sends its announcements for ever to each address that it was told: our settings ask for multicast of
// discovery alone.
TEST(Door, AddressesThatAreKeptForEverAreCounted) {
  for (const bool group : {false, true}) {
    Gate gate;
    const auto lets_in = [&](std::uint32_t who, std::uint32_t port) {
      Parameters p = said(who);
      p[2].second = locator(kHere.address, port);
      if (!group) p.erase(p.begin() + 3);
      gate.rest(0.5);
      return gate.passes(who, data(kParticipants, list(p)), socket(who));
    };
    std::uint32_t in = 0;
    for (std::uint32_t n = 0; n < 1000; ++n) in += lets_in(n, 20'000 + n);
    EXPECT_EQ(in, Door::kAddresses + 499 / Door::kNextAddress_s);
    EXPECT_TRUE(lets_in(3000, 20'250)) << "where another was";
    gate.rest(Door::kNextAddress_s);
    EXPECT_TRUE(lets_in(4000, 40'000)) << "nobody is out for ever";
    for (in = 0; in < 50; ++in) EXPECT_TRUE(lets_in(4000, 40'000)) << "the same again";
    in = 0;
    for (std::uint32_t n = 0; n < 1000; ++n) in += lets_in(4000, 50'000 + n);
    EXPECT_LE(in, 536 / Door::kNextAddress_s) << "one that is known, and names another address each time";
  }
}

}  // namespace
}  // namespace backwash::dds

namespace backwash::daemon {
namespace {

int taken_at(Allowance& allowance, std::int64_t now_ns) {
  int taken = 0;
  for (int n = 0; n < 100; ++n) taken += allowance.take(now_ns);
  return taken;
}

TEST(AllowanceTest, IsABurstThenOneAPeriodAndABurstAgainAfterARest) {
  Allowance allowance;
  std::int64_t now_ns = 1'000'000'000'000;
  EXPECT_EQ(taken_at(allowance, now_ns), Allowance::kBurst);
  for (int n = 0; n < 10; ++n) EXPECT_EQ(taken_at(allowance, now_ns += Allowance::kPrice_ns), 1);
  EXPECT_EQ(taken_at(allowance, now_ns += 3'600'000'000'000), Allowance::kBurst) << "an hour is worth no more";
}

}  // namespace
}  // namespace backwash::daemon
