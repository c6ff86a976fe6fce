// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/mavlink/frame.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string_view>

#include "tests/bridge/bytes.hpp"

namespace backwash::mavlink::test {
namespace {

constexpr std::uint8_t kHeartbeatCrcExtra = 50;  // of common.xml

/// A frame put together from the MAVLink guide's layout with the bitwise checksum.
Bytes by_hand(Bytes header, const Bytes& payload, std::uint8_t crc_extra, const Bytes& signature = {}) {
  Bytes frame = header + payload;
  Bytes summed(frame.begin() + 1, frame.end());
  summed.push_back(crc_extra);
  const std::uint16_t crc = crc_by_bits(summed);
  return frame + Bytes{static_cast<std::uint8_t>(crc), static_cast<std::uint8_t>(crc >> 8)} + signature;
}

const Bytes kHeartbeatPayload{0x00, 0x00, 0x06, 0x00, 2, 12, 0xD1, 4, 3};

Bytes heartbeat(std::uint8_t sequence, std::uint8_t incompat = 0, const Bytes& signature = {}) {
  return by_hand({0xFD, 9, incompat, 0, sequence, 1, 1, 0, 0, 0}, kHeartbeatPayload, kHeartbeatCrcExtra, signature);
}
Bytes heartbeat_v1(std::uint8_t sequence) {
  return by_hand({0xFE, 9, sequence, 1, 1, 0}, kHeartbeatPayload, kHeartbeatCrcExtra);
}
/// GPS_RAW_INT, which the codec does not know: 30 bytes that hold start bytes of both versions.
Bytes unknown_message(std::uint8_t sequence) {
  Bytes payload(30, 0x11);
  payload[3] = 0xFD;
  payload[12] = 0xFE;
  payload[20] = 0xFD;
  return by_hand({0xFD, 30, 0, 0, sequence, 1, 1, 24, 0, 0}, payload, 24);
}

std::vector<std::uint8_t> sequences(const std::vector<Received>& frames) {
  std::vector<std::uint8_t> s;
  for (const auto& r : frames) s.push_back(r.frame.sender.sequence);
  return s;
}

TEST(MavlinkCrc, EqualsThePublishedCheckValueAndTheBitwiseDefinition) {
  Crc crc;
  crc.add(std::string_view("123456789"));
  EXPECT_EQ(crc.value(), 0x6F91);
  std::mt19937 random(1);
  Crc table_free;
  Bytes bytes;
  for (int i = 0; i < 5000; ++i) {
    bytes.push_back(static_cast<std::uint8_t>(random()));
    table_free.add(bytes.back());
  }
  EXPECT_EQ(table_free.value(), crc_by_bits(bytes));
}

TEST(MavlinkCrc, CrcExtraFollowsFromTheDefinitions) {
  // Published values of common.xml.
  EXPECT_EQ(info<SimState>().crc_extra, 32);
  EXPECT_EQ(info<HilGps>().crc_extra, 124);
  EXPECT_EQ(info<ManualControl>().crc_extra, 243);
  EXPECT_EQ(info<ManualControl>().base_length, 11U);
  EXPECT_EQ(info<SimState>().base_length, 84U);
  EXPECT_EQ(info<HilGps>().base_length, 36U);
  EXPECT_EQ(info<HilGps>().full_length, 39U);
  EXPECT_EQ(info<SetGpsGlobalOrigin>().crc_extra, 41);
  EXPECT_EQ(info<SetGpsGlobalOrigin>().base_length, 13U);
  EXPECT_EQ(info<GpsGlobalOrigin>().crc_extra, 39);
  EXPECT_EQ(info<GpsGlobalOrigin>().base_length, 12U);
}

TEST(MavlinkFrame, EncodesAHeartbeatAsTheGuideLaysItOut) {
  const Heartbeat m{
      .custom_mode = 0x60000, .type = 2, .autopilot = 12, .base_mode = 0xD1, .system_status = 4, .mavlink_version = 3};
  const EncodedFrame f = encode_frame({1, 1, 7}, m);
  EXPECT_EQ(Bytes(f.view().begin(), f.view().end()), heartbeat(7));
}

TEST(MavlinkParser, AcceptsVersion1OfExactLengthOnly) {
  EXPECT_EQ(parse(heartbeat_v1(3)).size(), 1U);
  const Bytes shorter(kHeartbeatPayload.begin(), kHeartbeatPayload.end() - 1);
  EXPECT_TRUE(parse(by_hand({0xFE, 8, 3, 1, 1, 0}, shorter, kHeartbeatCrcExtra)).empty());
}

TEST(MavlinkParser, FramesSignedMessagesAndHandsTheSignatureOn) {
  Bytes signature;
  for (std::uint8_t i = 0; i < 13; ++i) signature.push_back(static_cast<std::uint8_t>(0xFD - i));
  const auto frames = parse(heartbeat(1, 1, signature) + heartbeat(2));
  ASSERT_EQ(sequences(frames), (std::vector<std::uint8_t>{1, 2}));
  EXPECT_EQ(frames[0].signature, signature);
  EXPECT_TRUE(frames[1].signature.empty());
}

TEST(MavlinkParser, DropsAndCountsFramesWithUnknownIncompatFlags) {
  Parser parser;
  std::vector<Received> frames;
  collect(parser, heartbeat(1, 0x02) + heartbeat(2) + heartbeat(3, 0x81, Bytes(13, 0xFE)) + heartbeat(4), frames);
  EXPECT_EQ(sequences(frames), (std::vector<std::uint8_t>{2, 4}));
  EXPECT_EQ(parser.counters().unknown_incompat, 2U);
  EXPECT_EQ(parser.counters().skipped_bytes, 0U);
}

TEST(MavlinkParser, PassesOverUnknownMessagesInStepAndCountsThem) {
  Parser parser;
  std::vector<Received> frames;
  collect(parser, heartbeat(1) + unknown_message(2) + unknown_message(3) + heartbeat(4), frames);
  EXPECT_EQ(sequences(frames), (std::vector<std::uint8_t>{1, 4}));
  EXPECT_EQ(parser.counters().unknown_id, 2U);
  EXPECT_EQ(parser.counters().skipped_bytes, 0U);
}

TEST(MavlinkParser, LosesNoFrameAfterOneByteIsLostOrAddedAnywhere) {
  const Bytes first = heartbeat(1), damaged = unknown_message(2), after = heartbeat(3) + heartbeat_v1(4) + heartbeat(5);
  for (const Bytes& victim : {heartbeat(2), unknown_message(2)}) {
    for (std::size_t i = 0; i < victim.size(); ++i) {
      Bytes lost = victim, added = victim;
      lost.erase(lost.begin() + static_cast<std::ptrdiff_t>(i));
      added.insert(added.begin() + static_cast<std::ptrdiff_t>(i), 0x55);
      for (const Bytes& broken : {lost, added}) {
        auto got = sequences(parse(first + broken + after + Bytes(300, 0)));
        std::erase(got, 2);  // an inserted byte before or after the frame leaves it whole
        ASSERT_EQ(got, (std::vector<std::uint8_t>{1, 3, 4, 5})) << "byte " << i << " of " << victim.size();
      }
    }
  }
}

TEST(MavlinkParser, ResultDoesNotDependOnHowTheStreamIsSplit) {
  const Bytes signature(13, 0xFD);
  const Bytes stream = Bytes{0xFD, 0x00, 0xFE, 0x09} + heartbeat(1) + unknown_message(2) + heartbeat(3, 1, signature) +
                       heartbeat_v1(4) + heartbeat(5, 2) + heartbeat(6);
  const std::vector<std::uint8_t> expected{1, 3, 4, 6};
  for (std::size_t cut = 0; cut <= stream.size(); ++cut) {
    Parser parser;
    std::vector<Received> frames;
    collect(parser, std::span(stream).first(cut), frames);
    collect(parser, std::span(stream).subspan(cut), frames);
    ASSERT_EQ(sequences(frames), expected) << "cut at " << cut;
  }
  Parser bytewise;
  std::vector<Received> frames;
  for (const auto byte : stream) collect(bytewise, {&byte, 1}, frames);
  EXPECT_EQ(sequences(frames), expected);
}

}  // namespace
}  // namespace backwash::mavlink::test
