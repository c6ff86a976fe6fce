// SPDX-License-Identifier: BSD-3-Clause
// The frames of the plain serial link against those of its document.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>
#include <vector>

#include "firmware_bridge/plain/plain.h"
#include "tests/bridge/plain/plain_frames.hpp"

namespace backwash::firmware_bridge::test {
namespace {

using mavlink::test::from_hex;
using mavlink::test::operator+;

/// The examples of the link's document, which were made by another implementation.
std::map<std::string, Bytes> examples() {
  std::ifstream document(std::string(BACKWASH_SOURCE_DIR) + "/docs/plain_link.md");
  std::map<std::string, Bytes> found;
  for (std::string line; std::getline(document, line);) {
    std::istringstream words(line);
    std::string name, hex, more;
    words >> name >> hex;
    if ((name == "command" || name == "pose" || name == "state") && hex.size() > 100 && !(words >> more))
      found[name] = from_hex(hex);
  }
  return found;
}

TEST(PlainFrame, TheDocumentsExamplesAreReadAndWrittenBitForBit) {
  const auto example = examples();
  ASSERT_EQ(example.size(), 3U);
  plain_receiver_t receiver{};
  ASSERT_EQ(events(receiver, example.at("command")), std::vector{PLAIN_COMMAND});
  plain_command_t c;
  plain_read_command(&receiver, &c);
  EXPECT_EQ(std::tuple(c.sequence, c.request, c.has_setpoint, c.time_ms), std::tuple(258, 1, true, 1000U));
  EXPECT_EQ(std::tuple(c.position[0], c.position[1], c.position[2], c.velocity[0], c.velocity[2], c.yaw),
            std::tuple(1.F, 2.F, 3.F, 0.5F, -0.25F, 1.5F));
  EXPECT_EQ(wire(c), example.at("command"));

  ASSERT_EQ(events(receiver, example.at("pose")), std::vector{PLAIN_POSE});
  plain_pose_t p;
  plain_read_pose(&receiver, &p);
  EXPECT_EQ(std::tuple(p.sequence, p.reset_counter, p.age_tenths_ms, p.time_ms), std::tuple(259, 7, 123, 1020U));
  EXPECT_EQ(std::tuple(p.position[0], p.position[1], p.position[2], p.attitude[0], p.velocity_b[0]),
            std::tuple(-1.F, 0.5F, 1.25F, 1.F, 0.1F));
  EXPECT_EQ(wire(p), example.at("pose"));

  ASSERT_EQ(events(receiver, example.at("state")), std::vector{PLAIN_STATE});
  plain_state_t s;
  plain_read_state(&receiver, &s);
  EXPECT_EQ(std::tuple(s.sequence, s.armed, s.following, s.on_ground, s.ground_known, s.failsafe, s.pose_known),
            std::tuple(65535, true, true, false, true, false, true));
  EXPECT_EQ(s.reset_counter, 7);
  EXPECT_EQ(std::tuple(s.answered, s.answer, s.time_ms, s.battery_percent, s.battery_millivolts),
            std::tuple(258, 1, 123456U, 87, 15600));
  EXPECT_EQ(std::tuple(s.position[2], s.velocity[0], s.attitude[0], s.rates[2]), std::tuple(3.F, 0.5F, 1.F, 0.125F));
  EXPECT_EQ(wire(s), example.at("state"));
}

TEST(PlainFrame, NoFlippedBitIsTaken) {
  for (const auto& [name, good] : examples())
    for (std::size_t bit = 0; bit < good.size() * 8; ++bit) {
      Bytes bad = good;
      bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ 1U << bit % 8);
      plain_receiver_t receiver{};
      for (const auto event : events(receiver, bad + Bytes{0})) EXPECT_EQ(event, PLAIN_REFUSED) << name << " " << bit;
    }
}

TEST(PlainFrame, ReceiversAreInStepAfterTheNextDelimiter) {
  const Bytes good = examples().at("state");
  for (std::size_t cut = 1; cut < good.size(); ++cut) {
    plain_receiver_t receiver{};
    const Bytes rest(good.begin() + static_cast<std::ptrdiff_t>(cut), good.end());
    const auto seen = events(receiver, rest + good);
    ASSERT_EQ(seen.back(), PLAIN_STATE) << cut;
    for (std::size_t i = 0; i + 1 < seen.size(); ++i) EXPECT_EQ(seen[i], PLAIN_REFUSED);
  }
  plain_receiver_t receiver{};
  EXPECT_EQ(events(receiver, Bytes(1000, 7) + Bytes{0, 0, 0} + good), (std::vector{PLAIN_REFUSED, PLAIN_STATE}));
}

TEST(PlainFrame, NumbersThatAreNotFiniteAreRefused) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), HUGE_VALF, -HUGE_VALF}) {
    plain_receiver_t receiver{};
    plain_command_t c{};
    c.yaw = bad;
    plain_pose_t p{};
    p.velocity_b[2] = bad;
    plain_state_t first{}, last{};
    first.position[0] = last.rates[2] = bad;
    for (const Bytes& bytes : {wire(c), wire(p), wire(first), wire(last)})
      EXPECT_EQ(events(receiver, bytes), std::vector{PLAIN_REFUSED});
  }
  plain_state_t largest{};
  largest.rates[2] = std::numeric_limits<float>::max();
  plain_receiver_t receiver{};
  EXPECT_EQ(events(receiver, wire(largest)), std::vector{PLAIN_STATE});
}

// What a receiver of the plain link refuses: frames made by the document alone, with the right checksum.

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
