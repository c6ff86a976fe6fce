// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "services/dds/guard/strangers.hpp"
#include "tests/daemon/in/rtps_packets.hpp"

/// Announcements of participants, and a door with a clock of its own.
namespace backwash::dds::packets {

constexpr std::uint32_t kParticipants = 0x000100c2, kSecureParticipants = 0xff0101c2, kSubscriptions = 0x000004c2,
                        kMessages = 0x000200c2, kHandshakes = 0x000201c3;
constexpr Door::Source kHere{0x7f000001, 40'000};

/// A participant by its number.
inline Packet prefix(std::uint32_t who) {
  Packet p(8, 0x11);
  p += number(who, 4);
  return p;
}

inline Packet from(std::uint32_t who) {
  Packet p = header();
  const Packet own = prefix(who);
  std::copy(own.begin(), own.end(), p.begin() + 8);
  return p;
}

inline Packet guid(std::uint32_t who, std::uint32_t entity) {
  Packet p = prefix(who);
  p += number(entity, 4, false);
  return p;
}

inline Packet locator(std::uint32_t address, std::uint32_t port, bool little = true) {
  Packet p = number(1, 4, little);
  p += number(port, 4, little);
  p += Packet(12);
  p += number(address, 4, false);
  return p;
}

inline Packet lease(std::uint32_t seconds, std::uint32_t fraction, bool little = true) {
  Packet p = number(seconds, 4, little);
  p += number(fraction, 4, little);
  return p;
}

inline Parameters said(std::uint32_t who, bool little = true) {
  return {{0x50, guid(who, 0x1c1)},
          {0x58, number(0xc3f, 4, little)},
          {0x32, locator(kHere.address, 7412, little)},
          {0x33, locator(0xefff0001, 7400, little)},
          {0x02, lease(0x7fffffff, 0xffffffff, little)}};
}

inline Packet announced(std::uint32_t who) { return data(kParticipants, list(said(who))); }

/// A door with a clock of its own; datagrams go through it.
struct Gate {
  std::unique_ptr<Door> door = std::make_unique<Door>(48);
  std::int64_t now_ns = 1'000'000'000'000;
  bool secured = false;

  Gate() { door->wants(std::vector<std::string>{"rt/abcd"}); }
  Packet left(Packet p, Door::Source source = kHere) {
    p.resize(let_in(*door, p, {source, now_ns, secured}));
    return p;
  }
  bool passes(std::uint32_t who, const Packet& one, Door::Source source = kHere) {
    const Packet after = left(whole({one}, from(who)), source);
    return after.size() > 20 && after[20] != kPad;
  }
  bool lets_in(std::uint32_t who, Door::Source source = kHere) { return passes(who, announced(who), source); }
  bool hears(std::uint32_t who) { return passes(who, submessage(kHeartbeat, Packet(28))); }
  /// Its n-th endpoint, or its end: true: the middleware sees it as it is, nothing: it is to come again.
  std::optional<bool> endpoint(std::uint32_t who, std::uint32_t n, bool gone = false,
                               const Parameters& more = {{0x05, kTopic}}) {
    Parameters p{{0x5a, guid(who, n << 8 | 4)}};
    p.insert(p.end(), more.begin(), more.end());
    Packet one = data(kSubscriptions, list(p));
    if (gone) one[1] = 0x09;
    rest(0.02);
    const Packet after = left(whole({one}, from(who)));
    if (after[20] != kData) return std::nullopt;
    return after == whole({one}, from(who));
  }
  void meet(std::uint32_t who) { door->met(Door::Prefix(prefix(who).data(), 12), now_ns); }
  void rest(double seconds) { now_ns += static_cast<std::int64_t>(seconds * 1e9); }
};

/// The n-th of sources of which no two share a socket, or none shares an address.
inline Door::Source socket(std::uint32_t n) { return {kHere.address, static_cast<std::uint16_t>(1024 + n)}; }
inline Door::Source address(std::uint32_t n) { return {0x0a000000 + n, 7411}; }

}  // namespace backwash::dds::packets
