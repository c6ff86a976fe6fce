// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

/// Layout of RTPS 2.3, the wire protocol of DDS, for those who look into datagrams: 8.3.3, 9.4.2, 9.6.2.
namespace backwash::dds::rtps {

using Bytes = std::span<std::uint8_t>;

constexpr std::size_t kHeader = 20, kSubmessageHeader = 4, kPrefixAt = 8, kPrefix = 12;
constexpr std::uint8_t kPad = 0x01, kInfoTimestamp = 0x09, kInfoSource = 0x0c, kInfoReplyIp4 = 0x0d,
                       kInfoDestination = 0x0e, kInfoReply = 0x0f, kData = 0x15, kDataFragment = 0x16,
                       kProtected = 0x31, kProtectedWhole = 0x33;
constexpr std::uint8_t kLittleEndian = 0x01, kInlineQos = 0x02;                 // flags
constexpr std::uint8_t kPayload = 0x0c, kDataFlag = 0x04, kFragmentKey = 0x04;  // data or key; in fragments one flag
constexpr std::uint16_t kPidPad = 0, kPidSentinel = 1, kMustUnderstand = 0x4000;
constexpr std::uint32_t kParticipants = 0x000100c2, kParticipantMessage = 0x000200c2, kStatelessMessage = 0x000201c3,
                        kParticipantsSecure = 0xff0101c2, kTokenMessage = 0xff0202c3;  // writers

inline std::uint16_t read16(const std::uint8_t* at, bool little) noexcept {
  return static_cast<std::uint16_t>(little ? at[0] | at[1] << 8 : at[0] << 8 | at[1]);
}

inline std::uint32_t read32(const std::uint8_t* at, bool little) noexcept {
  const std::uint32_t first = read16(at, little), second = read16(at + 2, little);
  return little ? first | second << 16 : first << 16 | second;
}

}  // namespace backwash::dds::rtps
