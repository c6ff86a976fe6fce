// SPDX-License-Identifier: BSD-3-Clause
#include "services/dds/guard/packet_filter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <random>
#include <vector>

#include "services/dds/guard/loopback.hpp"
#include "tests/daemon/in/rtps_packets.hpp"

namespace backwash::dds {
namespace {

using namespace packets;

/// A datagram of these submessages, filtered.
Packet filtered(const std::vector<Packet>& submessages) {
  Packet p = header();
  for (const Packet& m : submessages) p += m;
  p.resize(filter_packet(p));
  return p;
}

TEST(PacketFilter, LeavesSamplesAndDiscoveryWithoutDescriptionsAsTheyAre) {
  for (const bool little : {true, false}) {
    const std::vector<Packet> good{data(kPublications, list({{0x05, kTopic}, {0x5a, Packet(16)}}, little)),
                                   submessage(kHeartbeat, Packet(28)), data(kUser, {0, 1, 0, 0, 0x75, 0, 4, 0})};
    EXPECT_EQ(filtered(good), whole(good));
  }
}

TEST(PacketFilter, MakesDescriptionsOfTypesPaddingInEitherByteOrder) {
  for (const bool little : {true, false}) {
    const auto before = filtered_parts();
    const auto with = [&](std::uint16_t id) {
      return std::vector<Packet>{
          data(kPublications, list({{0x05, kTopic}, {id, Packet(40, 0xf2)}, {0x07, kTopic}}, little))};
    };
    EXPECT_EQ(filtered(with(0x75)), whole(with(0)));
    EXPECT_EQ(filtered(with(0x72)), whole(with(0)));
    EXPECT_EQ(filtered(with(0x4075)), whole(with(0))) << "also if it must be understood";
    EXPECT_EQ(filtered_parts(), before + 3);
  }
}

TEST(PacketFilter, ShutsOutTheTypeLookupServiceAndDiscoveryInFragments) {
  const Packet heartbeat = submessage(kHeartbeat, Packet(28));
  for (const Packet& bad : {data(kTypeRequests, list({})), data(kTypeRequests + 0x100, list({})),
                            data(kPublications, list({}), kFragment)}) {
    Packet padded = bad;
    padded[0] = kPad;
    EXPECT_EQ(filtered({heartbeat, bad, heartbeat}), whole({heartbeat, padded, heartbeat}));
  }
}

// A handshake has a certificate and permissions in it; what comes after it is authenticated.
TEST(PacketFilter, LetsDdsSecurityThroughInFragmentsToo) {
  constexpr std::uint32_t kHandshake = 0x000201c3, kVolatile = 0xff0202c3, kSecurePublications = 0xff0003c2;
  for (const std::uint32_t writer : {kHandshake, kVolatile, kSecurePublications}) {
    std::vector<Packet> good{data(writer, Packet(8, 0xf2)), data(writer, Packet(8, 0xf2), kFragment)};
    good[1][1] = 0x01;  // of fragments the flag of data in a whole is that of a key
    EXPECT_EQ(filtered(good), whole(good)) << writer;
  }
}

// One packet with a key in place of a handshake's data is a null pointer in libddsc 0.10.2.
TEST(PacketFilter, ShutsOutAHandshakeThatIsAKeyOrNothing) {
  for (const std::uint32_t writer : {0x000201c3u, 0xff0202c3u}) {
    for (const std::uint8_t flags : {0x01, 0x09, 0x0d}) {
      Packet bad = data(writer, Packet(8, 0xf2));
      bad[1] = flags;
      EXPECT_EQ(filtered({bad})[20], kPad) << writer << " " << int{flags};
    }
    Packet key = data(writer, Packet(8, 0xf2), kFragment);
    key[1] = 0x05;
    EXPECT_EQ(filtered({key})[20], kPad) << writer;
  }
}

TEST(PacketFilter, ShutsOutDiscoveryThatIsNotWellFormed) {
  const auto padded = [](Packet bad) {
    const Packet seen = filtered({bad, submessage(kHeartbeat, Packet(28))});
    return seen.size() == 20 + bad.size() + 32 && seen[20] == kPad;
  };
  Packet odd = list({{0x05, kTopic}}), over = odd, endless = odd;
  odd[6] = 11;
  over[6] = 200;
  endless.resize(endless.size() - 4);
  for (const Packet& payload : {odd, over, endless, Packet{}, Packet{0, 3, 0}, Packet{0, 1, 0, 0, 1, 0, 0, 0}})
    EXPECT_TRUE(padded(data(kPublications, payload)));
  EXPECT_TRUE(padded(data(0x000200c2, {0, 1, 0, 0})));  // a participant message without its GUID
  Packet inline_qos = data(kUser, {0x70, 0, 0xff, 0xff});
  inline_qos[1] |= 0x02;
  EXPECT_TRUE(padded(inline_qos));
}

TEST(PacketFilter, CutsWhatIsLongerThanTheDatagram) {
  const Packet heartbeat = submessage(kHeartbeat, Packet(28));
  Packet cut = submessage(kHeartbeat, Packet(28));
  cut.resize(20);
  EXPECT_EQ(filtered({heartbeat, cut}), whole({heartbeat}));
  EXPECT_EQ(filtered({heartbeat, {kHeartbeat, 1}}), whole({heartbeat}));
}

// With the address sanitizer, this also shows that nothing beyond the datagram is read.
TEST(PacketFilter, WhateverComesItKeepsTheHeaderAndNeverGrows) {
  std::mt19937 random(1);
  const Packet seed = whole({data(kPublications, list({{0x05, kTopic}, {0x75, Packet(40, 0xf2)}})),
                             submessage(kHeartbeat, Packet(28)), data(kUser, list({{0x70, kTopic}}))});
  for (int round = 0; round < 200'000; ++round) {
    Packet p(seed.begin(), seed.begin() + static_cast<long>(random() % (seed.size() + 1)));
    for (std::size_t n = random() % 6; n > 0 && p.size() > 20; --n)
      p[20 + random() % (p.size() - 20)] = static_cast<std::uint8_t>(random() % 3 ? random() : 0xff);
    const Packet before = p;
    const std::size_t left = filter_packet(p);
    ASSERT_LE(left, p.size());
    ASSERT_GE(left, std::min<std::size_t>(20, p.size()));
    p.resize(left);
    Packet again = p;
    ASSERT_EQ(filter_packet(again), left) << "what passed once passes again";
    ASSERT_EQ(again, p);
  }
}

TEST(PacketFilter, LeavesOtherProtocolsAlone) {
  Packet other{'G', 'E', 'T', ' ', '/'};
  const Packet before = other;
  EXPECT_EQ(filter_packet(other), 5u);
  EXPECT_EQ(other, before);
}

/// A locator as discovery says it: of UDP over IPv4 unless its kind is another.
Packet locator(const std::array<std::uint8_t, 4>& address, bool little, std::uint32_t kind = 1) {
  Packet p = number(kind, 4, little);
  p += number(7411, 4, little);
  p += Packet(12);
  p += Packet(address.begin(), address.end());
  return p;
}

constexpr bool ours(std::uint32_t address) { return address == 0x0a630001; }  // 10.99.0.1

TEST(Loopback, TakesThePlaceOfThisMachinesAddressesAndOfNoOther) {
  constexpr std::uint32_t kParticipants = 0x000100c2;
  for (const bool little : {true, false}) {
    const auto said = [&](const std::array<std::uint8_t, 4>& a) {
      Parameters all{{0x05, kTopic}};
      for (const std::uint16_t id : {0x2f, 0x31, 0x32, 0x4032}) all.push_back({id, locator(a, little)});
      return data(kParticipants, list(all, little));
    };
    Packet p = whole({said({10, 99, 0, 1}), said({10, 99, 0, 2}), said({127, 0, 0, 1})});
    EXPECT_EQ(by_loopback(p, ours), 4u);
    EXPECT_EQ(p, whole({said({127, 0, 0, 1}), said({10, 99, 0, 2}), said({127, 0, 0, 1})}));
  }
}

TEST(Loopback, LeavesGroupsOtherKindsSamplesAndWhatIsCutOffAsTheyAre) {
  const Packet mine = locator({10, 99, 0, 1}, true);
  Packet cut = data(kPublications, list({{0x2f, mine}}));
  cut.resize(cut.size() - 12);
  for (const Packet& m :
       {data(kPublications, list({{0x30, mine}, {0x33, mine}, {0x2f, locator({10, 99, 0, 1}, true, 2)}})),
        data(kUser, list({{0x2f, mine}})), data(kPublications, list({{0x2f, mine}}), kFragment), cut}) {
    Packet p = whole({m});
    EXPECT_EQ(by_loopback(p, ours), 0u);
    EXPECT_EQ(p, whole({m}));
  }
}

TEST(Loopback, ReadsNothingBeyondADatagramOfAnyLength) {
  const Packet good = whole({data(kPublications, list({{0x2f, locator({10, 99, 0, 1}, true)}, {0x05, kTopic}}))});
  for (std::size_t length = 0; length <= good.size(); ++length) {
    const std::unique_ptr<std::uint8_t[]> exact(new std::uint8_t[length]);
    std::copy_n(good.begin(), length, exact.get());
    by_loopback({exact.get(), length}, ours);
  }
}

}  // namespace
}  // namespace backwash::dds
