// SPDX-License-Identifier: BSD-3-Clause
// The codec against frames and definitions made by independent reference encoders (tests/data).
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "tests/bridge/bytes.hpp"

namespace backwash::mavlink::test {
namespace {

using nlohmann::json;

class MavlinkVectors : public testing::Test {
 protected:
  void SetUp() override { data_ = json::parse(std::ifstream(BACKWASH_SOURCE_DIR "/tests/data/mavlink_vectors.json")); }
  json data_;
};

// The functions that touch JSON or gtest are not templates: the sanitizers' compile time needs small instances.

double number(const json& j) {
  if (!j.is_string()) return j.get<double>();
  const auto text = j.get<std::string>();
  if (text == "NaN") return std::numeric_limits<double>::quiet_NaN();
  return text == "Infinity" ? HUGE_VAL : -HUGE_VAL;
}

std::uint64_t integer_bits(const json& j) {
  return j.is_number_unsigned() ? j.get<std::uint64_t>() : static_cast<std::uint64_t>(j.get<std::int64_t>());
}

template <class T>
T scalar(const json& j) {
  if constexpr (std::is_floating_point_v<T>) return static_cast<T>(number(j));
  return static_cast<T>(integer_bits(j));
}

template <class T>
void assign(T& member, const json& j) {
  member = scalar<T>(j);
}
template <class T, std::size_t N>
void assign(std::array<T, N>& member, const json& j) {
  if constexpr (std::is_same_v<T, char>) {
    const auto& text = j.get_ref<const std::string&>();
    std::copy_n(text.begin(), std::min(N, text.size()), member.begin());
  } else {
    for (std::size_t i = 0; i < N; ++i) member[i] = scalar<T>(j.at(i));
  }
}

const json& value_of(const json& fields, std::string_view name) { return fields.at(std::string(name)); }

/// The message that the vector's field values describe.
template <class Message>
Message from_json(const json& fields) {
  Message m;
  std::apply([&](const auto&... f) { (assign(m.*(f.member), value_of(fields, f.name)), ...); }, Message::fields());
  return m;
}

/// Same values; any NaN equals any NaN, −0 differs from 0.
template <class T>
bool same(const T& a, const T& b) {
  if constexpr (std::is_same_v<T, float>) {
    return (std::isnan(a) && std::isnan(b)) || std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
  } else {
    return a == b;
  }
}
template <class T, std::size_t N>
bool same(const std::array<T, N>& a, const std::array<T, N>& b) {
  for (std::size_t i = 0; i < N; ++i) {
    if (!same(a[i], b[i])) return false;
  }
  return true;
}
void expect_same(bool equal, std::string_view field) { EXPECT_TRUE(equal) << field; }

template <class Message>
void expect_same_values(const Message& a, const Message& b) {
  std::apply([&](const auto&... f) { (expect_same(same(a.*(f.member), b.*(f.member)), f.name), ...); },
             Message::fields());
}

template <class... Messages>
std::vector<const MessageInfo*> known(MessageList<Messages...>) {
  return {find_message(Messages::kId)...};
}

TEST_F(MavlinkVectors, DefinitionsGiveTheSameIdsLengthsAndCrcExtra) {
  std::size_t checked = 0;
  for (const auto* m : known(KnownMessages{})) {
    ASSERT_NE(m, nullptr);
    if (!data_["messages"].contains(std::string(m->name))) continue;  // frame_test has its published CRC_EXTRA
    const json& expected = data_["messages"].at(std::string(m->name));
    EXPECT_EQ(m->id, expected["msgid"]) << m->name;
    EXPECT_EQ(m->crc_extra, expected["crc_extra"]) << m->name;
    EXPECT_EQ(m->full_length, expected["max_payload_len"]) << m->name;
    EXPECT_EQ(m->base_length, expected["min_payload_len_without_extensions"]) << m->name;
    ++checked;
  }
  EXPECT_EQ(checked, data_["messages"].size()) << "a message of the data is not in the codec";
}

TEST_F(MavlinkVectors, EveryFrameDecodesToItsFieldValues) {
  for (const json& v : data_["vectors"]) {
    SCOPED_TRACE(v["name"].get<std::string>());
    const auto frames = parse(from_hex(v["frame_hex"]));
    ASSERT_EQ(frames.size(), 1U);
    const Received& r = frames[0];
    EXPECT_EQ(r.frame.sender.system, v["sysid"]);
    EXPECT_EQ(r.frame.sender.component, v["compid"]);
    EXPECT_EQ(r.frame.sender.sequence, v["seq"]);
    EXPECT_EQ(r.frame.incompat_flags, v["incompat_flags"]);
    EXPECT_EQ(r.frame.id, v["msgid"]);
    EXPECT_EQ(r.payload, from_hex(v["payload_hex"]));
    EXPECT_EQ(r.signature, v.contains("signing") ? from_hex(v["signing"]["signature_block_hex"]) : Bytes{});
    EXPECT_TRUE(decode_and_visit(r.frame.id, r.payload, [&]<class Message>(const Message& m) {
      expect_same_values(m, from_json<Message>(v["fields"]));
    }));
  }
}

TEST_F(MavlinkVectors, EveryUnsignedMessageEncodesToTheSameBytes) {
  int checked = 0;
  for (const json& v : data_["vectors"]) {
    SCOPED_TRACE(v["name"].get<std::string>());
    const Sender sender{v["sysid"], v["compid"], v["seq"]};
    Payload payload;
    EncodedFrame frame;
    decode_and_visit(v["msgid"], {}, [&]<class Message>(const Message&) {
      const auto message = from_json<Message>(v["fields"]);
      payload = encode(message);
      frame = encode_frame(sender, message);
    });
    EXPECT_EQ(Bytes(payload.bytes.begin(), payload.bytes.begin() + static_cast<std::ptrdiff_t>(payload.length)),
              from_hex(v["payload_hex"]));
    if (v["incompat_flags"] != 0) continue;
    EXPECT_EQ(Bytes(frame.view().begin(), frame.view().end()), from_hex(v["frame_hex"]));
    ++checked;
  }
  EXPECT_GE(checked, 30);
}

TEST_F(MavlinkVectors, ParserCasesEndAsTheReferenceParserEndsThem) {
  for (const json& c : data_["parser_cases"]) {
    const auto name = c["name"].get<std::string>();
    SCOPED_TRACE(name);
    Parser parser;
    std::vector<Received> frames;
    collect(parser, from_hex(c["frame_hex"]), frames);
    if (name == "garbage_then_3_heartbeats") {
      EXPECT_EQ(frames.size(), 3U) << "none of the good frames is lost here";
    } else if (name.starts_with("signed_")) {
      // Whether a signature counts is not the parser's to say: it frames them and hands the signature block on.
      ASSERT_EQ(frames.size(), name == "signed_replayed" ? 2U : 1U);
      EXPECT_EQ(frames.back().signature.size(), kSignature);
      EXPECT_EQ(parser.counters().skipped_bytes, 0U);
    } else {
      EXPECT_EQ(frames.size(), c["expect"] == "accept" ? 1U : 0U);
    }
    if (name == "unknown_incompat_flag") {
      EXPECT_EQ(parser.counters().unknown_incompat, 1U);
      EXPECT_EQ(parser.counters().skipped_bytes, 0U) << "the whole frame is dropped";
    }
    if (name == "bad_crc" || name == "wrong_crc_extra") {
      EXPECT_EQ(parser.counters().bad_crc, 1U);
    }
  }
}

TEST_F(MavlinkVectors, OlderAndNewerPayloadLengthsCarryTheSameValues) {
  const auto payload_of = [&](const std::string& name) -> Bytes {
    for (const char* list : {"parser_cases", "vectors"}) {
      for (const json& c : data_[list]) {
        if (c["name"] == name) return parse(from_hex(c["frame_hex"])).at(0).payload;
      }
    }
    ADD_FAILURE() << "no vector " << name;
    return {};
  };
  const Bytes whole = payload_of("untruncated_local_position");
  ASSERT_EQ(whole.size(), 28U);
  expect_same_values(decode<LocalPositionNed>(whole), decode<LocalPositionNed>(std::span(whole).first(8)));
  EXPECT_EQ(decode<LocalPositionNed>(whole).x, 1.0F);
  expect_same_values(decode<Heartbeat>(payload_of("heartbeat_longer_than_known")),
                     decode<Heartbeat>(payload_of("heartbeat_px4_quad")));
  expect_same_values(decode<Heartbeat>(payload_of("mavlink1_heartbeat")),
                     decode<Heartbeat>(payload_of("heartbeat_px4_quad")));
}

}  // namespace
}  // namespace backwash::mavlink::test
