// SPDX-License-Identifier: BSD-3-Clause
#include "tests/daemon/in/strangers_rig.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace backwash::dds {
namespace {

using namespace packets;

TEST(Strangers, NothingOfWhoIsNotKnownIsLeftButTheAnnouncement) {
  Gate gate;
  const Packet timestamp = submessage(0x09, Packet(8), 1), heartbeat = submessage(kHeartbeat, Packet(28)),
               sample = data(kUser, {0, 1, 0, 0, 1, 2, 3, 4});
  Packet padded = heartbeat, no_sample = sample;
  padded[0] = no_sample[0] = kPad;
  EXPECT_EQ(gate.left(whole({timestamp, heartbeat, sample}, from(1))), whole({timestamp, padded, no_sample}, from(1)));
  const Packet after = gate.left(whole({timestamp, announced(1), heartbeat, sample}, from(1)));
  EXPECT_EQ(std::vector(after.end() - static_cast<long>(heartbeat.size() + sample.size()), after.end()),
            std::vector(whole({heartbeat, sample}, Packet())));
  EXPECT_TRUE(gate.hears(1));
  EXPECT_FALSE(gate.hears(2));
}

TEST(Strangers, ALeaseIsCutInEitherByteOrderAndAShortOneStays) {
  for (const bool little : {true, false}) {
    Gate gate;
    Parameters p = said(1, little), cut = p;
    cut[4].second = lease(Door::kLease_s, 0, little);
    EXPECT_EQ(gate.left(whole({data(kParticipants, list(p, little))}, from(1))),
              whole({data(kParticipants, list(cut, little))}, from(1)));
    p[4].second = lease(10, 5, little);
    const Packet good = whole({data(kParticipants, list(p, little))}, from(1));
    EXPECT_EQ(gate.left(good), good);
    p[4].second = lease(0xffffffff, 0, little);
    EXPECT_EQ(gate.left(whole({data(kParticipants, list(p, little))}, from(1))),
              whole({data(kParticipants, list(cut, little))}, from(1)));
  }
  Gate gate;
  Parameters none = said(1);
  none.pop_back();
  EXPECT_FALSE(gate.passes(1, data(kParticipants, list(none)))) << "without one it would be 100 s";
}

// A stranger of another's prefix, or who speaks as another within a datagram, is that other.
TEST(Strangers, WhoAnnouncesSpeaksForItselfAlone) {
  Gate gate;
  EXPECT_FALSE(gate.passes(1, announced(2)));
  EXPECT_FALSE(gate.hears(1) || gate.hears(2));
  Packet turned = number(0, 8);
  turned += prefix(3);
  const Packet source = submessage(0x0c, turned, 1);
  for (const Packet& second : {announced(1), data(kPublications, list({{0x05, kTopic}, {0x5a, guid(3, 0x103)}}))})
    EXPECT_EQ(gate.left(whole({announced(1), source, second}, from(1)))[20 + announced(1).size() + source.size()],
              kPad);
  EXPECT_EQ(gate.left(whole({source, announced(3)}, from(1)))[20 + source.size()], kData);
  EXPECT_TRUE(gate.hears(1) && gate.hears(3));
  EXPECT_FALSE(gate.passes(1, data(kPublications, list({{0x05, kTopic}, {0x5a, guid(3, 0x103)}}))));
  EXPECT_FALSE(gate.passes(1, data(kPublications, list({{0x05, kTopic}}))));
  Packet alive{0, 1, 0, 0};
  alive += guid(3, 0);
  EXPECT_FALSE(gate.passes(1, data(kMessages, alive))) << "the life or death of another";
  EXPECT_TRUE(gate.passes(3, data(kMessages, alive)));
}

// Writers, under which the middleware takes an announcement from anybody.
TEST(Strangers, TheAnnouncementOfSecurePeersIsOneToo) {
  for (const std::uint32_t writer : {kParticipants, kSecureParticipants}) {
    Gate gate;
    std::size_t in = 0;
    for (std::uint32_t who = 0; who < 100; ++who) in += gate.passes(who, data(writer, list(said(who))));
    EXPECT_EQ(in, static_cast<std::size_t>(Door::kFirstOfSocket)) << writer;
    EXPECT_FALSE(gate.passes(200, data(writer, list(said(200)), kFragment), address(1)));
  }
}

// OpenSplice's service for a computer keeps all participants of it alive.
TEST(Strangers, NoAnnouncementKeepsOthersAlive) {
  for (const bool little : {true, false}) {
    Gate gate;
    Packet version = number(0, 4, little);
    version += number(0x1c, 4, little);
    Parameters p = said(1, little);
    p[4].second = lease(10, 0, little);
    p.push_back({0x8007, version});
    const Packet after = gate.left(whole({data(kParticipants, list(p, little))}, from(1)));
    p[5].second[little ? 4 : 7] = 0x0c;
    EXPECT_EQ(after, whole({data(kParticipants, list(p, little))}, from(1)));
  }
}

TEST(Strangers, WithSecurityWhoNamesNoIdentityIsNotLetInAndPlainDiscoveryIsNotHeard) {
  Gate gate;
  gate.secured = true;
  EXPECT_FALSE(gate.lets_in(1));
  Parameters p = said(1);
  p.push_back({0x1001, Packet(40)});
  EXPECT_FALSE(gate.passes(1, data(kParticipants, list(p)))) << "without the secure topics it is treated as plain";
  p[1].second = number(1u << 26 | 0xc3f, 4);
  EXPECT_TRUE(gate.passes(1, data(kParticipants, list(p))));
  EXPECT_TRUE(gate.passes(1, data(kHandshakes, Packet(8))));
  EXPECT_FALSE(gate.passes(1, data(kPublications, list({{0x05, kTopic}, {0x5a, guid(1, 0x103)}}))));
  Packet alive{0, 1, 0, 0};
  alive += guid(1, 0);
  Packet dead = data(kMessages, alive);
  EXPECT_TRUE(gate.passes(1, dead)) << "comes plain from those with credentials, too";
  dead[1] = 0x09;
  EXPECT_FALSE(gate.passes(1, dead)) << "anybody may have said it";
  Packet protected_whole = whole({submessage(0x33, Packet(16)), dead}, from(1));
  EXPECT_EQ(gate.left(protected_whole), protected_whole);
  std::copy_n(prefix(2).begin(), 12, protected_whole.begin() + 8);
  EXPECT_EQ(gate.left(protected_whole).size(), 20u);
}

TEST(Strangers, AHandshakeInFragmentsIsNoLargerThanOneIs) {
  Gate gate;
  ASSERT_TRUE(gate.lets_in(1));
  const auto fragment = [](std::uint32_t each, std::uint32_t size) {
    Packet one = data(kHandshakes, Packet(8), kFragment);
    const Packet e = number(each, 2), s = number(size, 4);
    std::copy(e.begin(), e.end(), one.begin() + 30);
    std::copy(s.begin(), s.end(), one.begin() + 32);
    return one;
  };
  EXPECT_TRUE(gate.passes(1, fragment(1344, 9000)));
  EXPECT_FALSE(gate.passes(1, fragment(1, 9000)));
  EXPECT_FALSE(gate.passes(1, fragment(1344, 1 << 26)));
}

// With the address sanitizer, this also shows that nothing beyond the datagram is read.
TEST(Strangers, WhateverComesItKeepsTheHeaderAndNeverGrows) {
  std::mt19937 random(48);
  Gate gate;
  const Packet seed = whole({announced(1), data(kPublications, list({{0x05, kTopic}, {0x5a, guid(1, 0x103)}})),
                             submessage(0x0c, Packet(20), 1), data(kMessages, guid(1, 0))},
                            from(1));
  for (int round = 0; round < 200'000; ++round, gate.now_ns += 100'000'000) {
    Packet p(seed.begin(), seed.begin() + static_cast<long>(random() % (seed.size() + 1)));
    for (std::size_t n = random() % 6; n > 0 && p.size() > 20; --n)
      p[20 + random() % (p.size() - 20)] = static_cast<std::uint8_t>(random() % 3 ? random() : 0xff);
    const std::size_t before = p.size(), after = gate.left(p).size();
    ASSERT_LE(after, before);
    ASSERT_GE(after, std::min<std::size_t>(20, before));
  }
}

}  // namespace
}  // namespace backwash::dds
