// SPDX-License-Identifier: BSD-3-Clause
// What a receiver of the plain link refuses: frames made by the document alone, with the right checksum.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <vector>

#include "firmware_bridge/plain/plain.h"

namespace backwash::firmware_bridge::test {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// What the receiver makes of the last byte of these.
plain_event_t last_event(plain_receiver_t& receiver, const Bytes& bytes) {
  plain_event_t event = PLAIN_NOTHING;
  for (const auto byte : bytes) event = plain_receive(&receiver, byte);
  return event;
}

/// A frame of this body as the document tells it: CRC-32 behind it, then COBS and the delimiter.
Bytes framed(Bytes body) {
  std::uint32_t crc = ~0U;
  for (const auto byte : body) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = crc & 1U ? crc >> 1 ^ 0xEDB88320U : crc >> 1;
  }
  for (int i = 0; i < 4; ++i) body.push_back(static_cast<std::uint8_t>(~crc >> 8 * i));
  Bytes out;
  for (auto at = body.begin();;) {
    const auto zero = std::find(at, body.end(), 0);
    out.push_back(static_cast<std::uint8_t>(zero - at + 1));
    out.insert(out.end(), at, zero);
    if (zero == body.end()) break;
    at = zero + 1;
  }
  out.push_back(0);
  return out;
}

TEST(PlainReceiver, RefusesAFrameOfAnotherVersionKindOrLengthThoughItsChecksumIsRight) {
  const std::map<char, std::size_t> sizes{{'C', 52}, {'P', 52}, {'S', 68}};
  for (const auto& [kind, size] : sizes) {
    Bytes body(size, 0);
    body[0] = static_cast<std::uint8_t>(kind);
    body[1] = PLAIN_VERSION;
    plain_receiver_t receiver{};
    ASSERT_NE(last_event(receiver, framed(body)), PLAIN_REFUSED) << kind << " itself is right";
    for (const unsigned version : {0U, PLAIN_VERSION + 1, 255U}) {
      Bytes other = body;
      other[1] = static_cast<std::uint8_t>(version);
      EXPECT_EQ(last_event(receiver, framed(other)), PLAIN_REFUSED) << kind << " of version " << version;
    }
    for (std::size_t length = 2; length <= 72; ++length) {
      if (length == size) continue;
      Bytes other = body;
      other.resize(length, 0);
      EXPECT_EQ(last_event(receiver, framed(other)), PLAIN_REFUSED) << kind << length;
    }
    Bytes other = body;
    other[0] = 'X';
    EXPECT_EQ(last_event(receiver, framed(other)), PLAIN_REFUSED);
  }
}

}  // namespace
}  // namespace backwash::firmware_bridge::test
