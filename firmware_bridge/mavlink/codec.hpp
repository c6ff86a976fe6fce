// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <tuple>
#include <type_traits>

// Payloads of MAVLink messages, encoded and decoded from the list of members that each message names in fields().
// Ids, lengths and CRC_EXTRA follow from that one list at compile time.

namespace backwash::mavlink {

inline constexpr std::size_t kMaxPayload = 255;

/// CRC-16/MCRF4XX (reflected polynomial 0x1021, start 0xFFFF, no final xor), as MAVLink's checksum. Real-time.
class Crc {
 public:
  constexpr void add(std::uint8_t byte) noexcept {
    const auto low = static_cast<std::uint8_t>(byte ^ (value_ & 0xFF));
    const auto t = static_cast<std::uint8_t>(low ^ (low << 4));
    value_ = static_cast<std::uint16_t>((value_ >> 8) ^ (t << 8) ^ (t << 3) ^ (t >> 4));
  }
  constexpr void add(std::span<const std::uint8_t> bytes) noexcept {
    for (const auto byte : bytes) add(byte);
  }
  constexpr void add(std::string_view text) noexcept {
    for (const char c : text) add(static_cast<std::uint8_t>(c));
  }
  constexpr std::uint16_t value() const noexcept { return value_; }

 private:
  std::uint16_t value_ = 0xFFFF;
};

/// One member of a message: its MAVLink name and where it lives. Extension members came later than the message: they
/// stand last on the wire, older senders leave them out, and they do not enter CRC_EXTRA.
template <class Message, class Member>
struct Field {
  std::string_view name;
  Member Message::*member;
  bool extension;
};
template <class Message, class Member>
constexpr Field<Message, Member> field(std::string_view name, Member Message::*member) noexcept {
  return {name, member, false};
}
template <class Message, class Member>
constexpr Field<Message, Member> extension(std::string_view name, Member Message::*member) noexcept {
  return {name, member, true};
}

/// Scalar type of a member and its number of elements (0: not an array).
template <class Member>
struct Wire {
  using Scalar = Member;
  static constexpr std::size_t kArray = 0;
};
template <class Element, std::size_t N>
struct Wire<std::array<Element, N>> {
  using Scalar = Element;
  static constexpr std::size_t kArray = N;
};

/// The name that MAVLink's definitions give a scalar type; it enters CRC_EXTRA.
template <class Scalar>
constexpr std::string_view type_name() noexcept {
  if constexpr (std::is_same_v<Scalar, char>) return "char";
  if constexpr (std::is_same_v<Scalar, float>) return "float";
  if constexpr (std::is_same_v<Scalar, std::int8_t>) return "int8_t";
  if constexpr (std::is_same_v<Scalar, std::uint8_t>) return "uint8_t";
  if constexpr (std::is_same_v<Scalar, std::int16_t>) return "int16_t";
  if constexpr (std::is_same_v<Scalar, std::uint16_t>) return "uint16_t";
  if constexpr (std::is_same_v<Scalar, std::int32_t>) return "int32_t";
  if constexpr (std::is_same_v<Scalar, std::uint32_t>) return "uint32_t";
  if constexpr (std::is_same_v<Scalar, std::int64_t>) return "int64_t";
  if constexpr (std::is_same_v<Scalar, std::uint64_t>) return "uint64_t";
}

/// What framing must know of a message.
struct MessageInfo {
  std::uint32_t id = 0;
  std::string_view name;
  std::uint8_t crc_extra = 0;   ///< checksum of the definition, added to each frame's CRC
  std::size_t base_length = 0;  ///< payload bytes without extension members (MAVLink 1 sends exactly these)
  std::size_t full_length = 0;  ///< payload bytes with extension members
};

/// MessageInfo of `Message`, from its fields(): CRC_EXTRA is the CRC of "NAME type name …" over the base members, each
/// array followed by its length, folded to a byte (MAVLink guide, "Serialization").
template <class Message>
constexpr MessageInfo info() noexcept {
  MessageInfo m{Message::kId, Message::kName};
  Crc crc;
  crc.add(Message::kName);
  crc.add(" ");
  const auto describe = [&]<class Member>(const Field<Message, Member>& f) {
    m.full_length += sizeof(Member);
    if (f.extension) return;
    m.base_length += sizeof(Member);
    crc.add(type_name<typename Wire<Member>::Scalar>());
    crc.add(" ");
    crc.add(f.name);
    crc.add(" ");
    if (Wire<Member>::kArray > 0) crc.add(static_cast<std::uint8_t>(Wire<Member>::kArray));
  };
  std::apply([&](const auto&... f) { (describe(f), ...); }, Message::fields());
  m.crc_extra = static_cast<std::uint8_t>((crc.value() & 0xFF) ^ (crc.value() >> 8));
  return m;
}

/// A payload as it goes on the wire: `length` of the bytes are sent.
struct Payload {
  std::array<std::uint8_t, kMaxPayload> bytes{};
  std::size_t length = 0;
};

static_assert(std::endian::native == std::endian::little,
              "members are copied as they lie in memory; MAVLink is little-endian");

/// Payload of a message, trailing zero bytes cut but for the first byte (MAVLink 2). Real-time: wait-free, no
/// allocation.
template <class Message>
Payload encode(const Message& message) noexcept {
  static_assert(info<Message>().full_length <= kMaxPayload);
  Payload payload;
  const auto write = [&]<class Member>(const Field<Message, Member>& f) {
    std::memcpy(payload.bytes.data() + payload.length, &(message.*f.member), sizeof(Member));
    payload.length += sizeof(Member);
  };
  std::apply([&](const auto&... f) { (write(f), ...); }, Message::fields());
  while (payload.length > 1 && payload.bytes[payload.length - 1] == 0) --payload.length;
  return payload;
}

/// Message of a payload of any length: what a shorter payload leaves out is zero (MAVLink's meaning of truncation and
/// of absent extensions), what a longer one adds is unknown and ignored. Real-time: wait-free, no allocation.
template <class Message>
Message decode(std::span<const std::uint8_t> payload) noexcept {
  std::array<std::uint8_t, kMaxPayload> bytes{};
  std::copy_n(payload.begin(), std::min(payload.size(), bytes.size()), bytes.begin());
  Message message;
  std::size_t offset = 0;
  const auto read = [&]<class Member>(const Field<Message, Member>& f) {
    std::memcpy(&(message.*f.member), bytes.data() + offset, sizeof(Member));
    offset += sizeof(Member);
  };
  std::apply([&](const auto&... f) { (read(f), ...); }, Message::fields());
  return message;
}

}  // namespace backwash::mavlink
