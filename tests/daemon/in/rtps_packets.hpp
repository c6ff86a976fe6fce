// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

/// Datagrams of RTPS, piece by piece, for the tests of what looks into them.
namespace backwash::dds::packets {

using Packet = std::vector<std::uint8_t>;
using Parameters = std::vector<std::pair<std::uint16_t, Packet>>;

constexpr std::uint32_t kPublications = 0x000003c2, kTypeRequests = 0x000300c3, kUser = 0x00000102;
constexpr std::uint8_t kData = 0x15, kFragment = 0x16, kHeartbeat = 0x07, kPad = 0x01;

inline Packet header() {
  Packet p(20);
  const std::uint8_t start[] = {'R', 'T', 'P', 'S', 2, 1};
  std::copy(std::begin(start), std::end(start), p.begin());
  return p;
}

inline Packet& operator+=(Packet& a, const Packet& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

inline Packet number(std::uint32_t value, int bytes, bool little = true) {
  Packet p;
  for (int n = 0; n < bytes; ++n) p.push_back(static_cast<std::uint8_t>(value >> 8 * (little ? n : bytes - 1 - n)));
  return p;
}

inline Packet list(const Parameters& parameters, bool little = true) {
  Packet p{0, static_cast<std::uint8_t>(little ? 3 : 2), 0, 0};
  for (const auto& [id, value] : parameters) {
    p += number(id, 2, little);
    p += number(static_cast<std::uint32_t>(value.size()), 2, little);
    p += value;
  }
  p += number(1, 2, little);
  p += number(0, 2, little);
  return p;
}

inline Packet submessage(std::uint8_t id, const Packet& body, std::uint8_t flags = 0x05) {
  Packet p{id, flags};
  p += number(static_cast<std::uint32_t>(body.size()), 2, flags & 1);
  p += body;
  return p;
}

/// DATA with this payload.
inline Packet data(std::uint32_t writer, const Packet& payload, std::uint8_t id = kData) {
  Packet body = number(0, 2);
  body += number(id == kData ? 16 : 28, 2);
  body += number(0, 4);
  body += number(writer, 4, false);
  body += number(0, 4);
  body += number(1, 4);
  if (id == kFragment) body += Packet(12);
  body += payload;
  return submessage(id, body);
}

inline Packet whole(const std::vector<Packet>& submessages, Packet p = header()) {
  for (const Packet& m : submessages) p += m;
  return p;
}

inline const Packet kTopic{8, 0, 0, 0, 'r', 't', '/', 'a', 'b', 'c', 'd', 0};

}  // namespace backwash::dds::packets
