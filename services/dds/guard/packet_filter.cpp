// SPDX-License-Identifier: BSD-3-Clause
#include "services/dds/guard/packet_filter.hpp"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <optional>

#include "services/dds/guard/rtps.hpp"

namespace backwash::dds {
namespace {

using namespace rtps;

constexpr std::uint16_t kTypePids[] = {0x0072, 0x0075};  // of DDS-XTypes: object, information

std::atomic<std::uint64_t> filtered{0};

// Makes parameters that describe types padding. The length of the list with its sentinel, or nothing if it has none.
std::optional<std::size_t> filter_parameters(Bytes list, bool little) noexcept {
  for (std::size_t at = 0; at + 4 <= list.size();) {
    const std::uint16_t pid = read16(&list[at], little), length = read16(&list[at + 2], little);
    if (pid == kPidSentinel) return at + 4;
    if (length % 4 != 0 || length > list.size() - at - 4) return std::nullopt;
    if (std::ranges::find(kTypePids, pid & ~kMustUnderstand) != std::end(kTypePids)) {
      list[at] = list[at + 1] = kPidPad;
      ++filtered;
    }
    at += 4 + length;
  }
  return std::nullopt;
}

// Content of a builtin topic: a parameter list, or, of participant messages, a GUID prefix, a kind and octets.
bool filter_builtin(Bytes payload, std::uint32_t writer) noexcept {
  if (payload.size() < 4 || payload[0] != 0) return false;
  const std::uint8_t encoding = payload[1];
  const bool little = encoding & 1;
  const Bytes content = payload.subspan(4);
  if (writer == kParticipantMessage)
    return encoding <= 1 && content.size() >= 20 && read32(&content[16], little) <= content.size() - 20;
  return (encoding == 2 || encoding == 3) && filter_parameters(content, little).has_value();
}

// DATA or DATA_FRAG, without its header. False: not to be parsed.
bool filter_data(Bytes body, std::uint8_t id, std::uint8_t flags) noexcept {
  const std::size_t fixed = id == kData ? 20 : 32;
  const bool little = flags & kLittleEndian;
  if (body.size() < fixed) return false;
  const std::uint32_t reader = read32(&body[4], false), writer = read32(&body[8], false);
  const std::size_t inline_qos = 4 + std::size_t{read16(&body[2], little)};
  if (inline_qos < fixed || inline_qos > body.size()) return false;
  Bytes rest = body.subspan(inline_qos);
  if (flags & kInlineQos) {
    const auto length = filter_parameters(rest, little);
    if (!length) return false;
    rest = rest.subspan(*length);
  }
  constexpr std::uint32_t kBuiltin = 0xc0;
  if ((writer & kBuiltin) != kBuiltin && (reader & kBuiltin) != kBuiltin) return true;
  // The type lookup service has the entities 0x000300.. and 0x000301...
  if (writer >> 9 == 0x000300u >> 1 || reader >> 9 == 0x000300u >> 1) return false;
  // A handshake of DDS Security carries a certificate and permissions: several fragments. It is never a key, which the
  // middleware would read through a null pointer.
  const bool handshake = writer == kStatelessMessage || writer == kTokenMessage;
  if (handshake) return id == kData ? (flags & kPayload) == kDataFlag : (flags & kFragmentKey) == 0;
  if (writer >> 24 == 0xff) return true;
  return id == kData && (!(flags & kPayload) || filter_builtin(rest, writer));
}

}  // namespace

std::size_t filter_packet(Bytes datagram) noexcept {
  if (datagram.size() < kHeader || std::memcmp(datagram.data(), "RTPS", 4) != 0) return datagram.size();
  for (std::size_t at = kHeader; at < datagram.size();) {
    const std::size_t left = datagram.size() - at;
    if (left < kSubmessageHeader) return at;
    std::uint8_t& id = datagram[at];
    const std::uint8_t flags = datagram[at + 1];
    std::size_t length = read16(&datagram[at + 2], flags & kLittleEndian);
    const bool to_the_end = length == 0 && id != kPad && id != kInfoTimestamp;
    if (to_the_end) length = left - kSubmessageHeader;
    if (length > left - kSubmessageHeader) return at;
    if (id == kData || id == kDataFragment) {
      if (!filter_data(datagram.subspan(at + kSubmessageHeader, length), id, flags)) {
        ++filtered;
        if (to_the_end) return at;
        id = kPad;
      }
    }
    at += kSubmessageHeader + length;
  }
  return datagram.size();
}

std::uint64_t filtered_parts() noexcept { return filtered; }

}  // namespace backwash::dds
