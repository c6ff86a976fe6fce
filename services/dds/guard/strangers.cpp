// SPDX-License-Identifier: BSD-3-Clause
#include "services/dds/guard/strangers.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <string_view>

#include "services/dds/guard/rtps.hpp"

namespace backwash::dds {
namespace {

using namespace rtps;

constexpr std::uint32_t kWriters = 0x000003c2, kReaders = 0x000004c2, kTopics = 0x000002c2;  // who announces those
constexpr std::uint16_t kPidLease = 0x0002, kPidTopic = 0x0005, kPidParticipant = 0x0050, kPidEndpoint = 0x005a,
                        kPidBuiltins = 0x0058, kPidUnicast = 0x0032, kPidKey = 0x0070, kPidStatus = 0x0071,
                        kPidIdentity = 0x1001, kPidVersion = 0x8007;
constexpr std::uint16_t kPidAddresses[] = {0x000b, 0x0045};  // of groups and of one, as RTPS 1 has them
constexpr std::uint32_t kSecureBuiltins = 1u << 26, kOfAllOthers = 1u << 4, kUdpV4 = 1;
constexpr std::size_t kMost = 4096;            // of an announcement, without padding
constexpr std::size_t kHandshake = 64u << 10;  // in fragments; one has a certificate and permissions in it
constexpr std::size_t kFragment = 1024;

std::atomic<std::uint64_t> kept_out{0};

/// The parameters of a list, one after the other; its bounds were checked, and are not trusted.
template <typename Each>
void each(Bytes list, bool little, Each&& take) {
  for (std::size_t at = 0; at + 4 <= list.size();) {
    const std::uint16_t pid = read16(&list[at], little), length = read16(&list[at + 2], little);
    if (pid == kPidSentinel || length > list.size() - at - 4) return;
    take(static_cast<std::uint16_t>(pid & ~kMustUnderstand), list.subspan(at + 4, length), &list[at]);
    at += 4u + length;
  }
}

/// A sample of discovery: what it is about, and what it says.
struct Sample {
  Bytes body, inline_qos, list;
  bool little_qos, little = false, gone = false;
  std::uint32_t writer;
  Sample(Bytes whole, std::uint8_t id, std::uint8_t flags) noexcept
      : body(whole), little_qos(flags & kLittleEndian), writer(read32(&whole[8], false)) {
    std::size_t at = 4 + std::size_t{read16(&body[2], little_qos)};
    if (at > body.size()) at = body.size();
    if (flags & kInlineQos) {
      inline_qos = body.subspan(at);
      while (at + 4 <= body.size()) {
        const std::uint16_t pid = read16(&body[at], little_qos), length = read16(&body[at + 2], little_qos);
        at = std::min(body.size(), at + 4 + (pid == kPidSentinel ? 0u : length));
        if (pid == kPidSentinel) break;
      }
      inline_qos = inline_qos.first(inline_qos.size() - (body.size() - at));
    }
    const bool payload = id == kData ? flags & kPayload : true;
    if (payload && body.size() - at >= 4) {
      little = body[at + 1] & 1;
      list = body.subspan(at + 4);
    }
    gone = id == kData && (flags & kPayload) != kDataFlag;
    each(inline_qos, little_qos, [&](std::uint16_t pid, Bytes value, std::uint8_t*) {
      if (pid == kPidStatus && value.size() == 4 && (value[3] & 3) != 0) gone = true;
    });
  }
};

/// One datagram's way through the door.
class Passage {
 public:
  Passage(Door& door, Bytes datagram, const Heard& heard) noexcept : door_(door), all_(datagram), heard_(heard) {
    speaks(datagram.subspan(kPrefixAt, kPrefix));
  }
  bool known() const noexcept { return known_; }
  void speaks(Bytes prefix) noexcept {
    std::ranges::copy(prefix, prefix_.begin());
    known_ = door_.knows(prefix_, heard_.now_ns);
  }
  /// False: not to be read.
  bool passes(std::uint8_t id, std::uint8_t flags, Bytes body) noexcept {
    switch (id) {
      case kPad:
      case kInfoTimestamp:
      case kInfoDestination:
      case kInfoReply:
      case kInfoReplyIp4:
        return true;
      case kInfoSource:
        if (body.size() < 8 + kPrefix) return false;
        speaks(body.subspan(8, kPrefix));
        return true;
      case kData:
      case kDataFragment:
        return body.size() >= (id == kData ? 20u : 32u) && data(id, flags, body);
      default:
        return known_;
    }
  }

 private:
  bool data(std::uint8_t id, std::uint8_t flags, Bytes body) noexcept {
    const std::uint32_t writer = read32(&body[8], false);
    if (writer == kParticipants || writer == kParticipantsSecure)
      return id == kData && participant(Sample(body, id, flags));
    if (!known_) return false;
    if ((writer & 0xc0) != 0xc0 || writer >> 24 == 0xff) return true;  // samples, and what comes protected alone
    const bool handshake = writer == kStatelessMessage;
    const bool message = writer == kParticipantMessage;
    if (writer == kTopics || (heard_.secured && !handshake && !message)) return false;
    if (!charged_ && !door_.takes(prefix_, all_.size(), heard_.now_ns)) return false;
    charged_ = true;
    if (id == kDataFragment) {
      const bool little = flags & kLittleEndian;
      return read32(&body[28], little) <= kHandshake && read16(&body[26], little) >= kFragment;
    }
    if (writer == kWriters || writer == kReaders) return endpoint(Sample(body, id, flags));
    if (!message) return true;
    // Of those with credentials, too, it comes plain, reliably: what is left out is asked for again, without end. That
    // one is gone comes protected as well.
    const Sample said(body, id, flags);
    return said.list.size() >= kPrefix && std::ranges::equal(said.list.first(kPrefix), prefix_) &&
           !(heard_.secured && said.gone);
  }

  bool own(Bytes guid) const noexcept {
    return guid.size() == kPrefix + 4 && std::ranges::equal(guid.first(kPrefix), prefix_);
  }

  bool participant(Sample said) noexcept {
    std::size_t size = 0;
    bool own_guid = false, foreign = false, lease = false, identity = false, secure = false;
    each(said.list, said.little, [&](std::uint16_t pid, Bytes value, std::uint8_t* at) {
      if (pid != kPidPad) size += 4 + value.size();
      if (std::ranges::find(kPidAddresses, pid) != std::end(kPidAddresses)) at[0] = at[1] = kPidPad;
      if (pid == kPidParticipant) (own(value) ? own_guid : foreign) = true;
      if (pid == kPidIdentity) identity = true;
      if (pid == kPidBuiltins && value.size() == 4) secure = read32(value.data(), said.little) & kSecureBuiltins;
      if (pid == kPidLease && value.size() == 8) {
        lease = true;
        cut(value, said.little);
      }
      if (pid == kPidVersion && value.size() >= 8)
        value[said.little ? 4 : 7] &= static_cast<std::uint8_t>(~kOfAllOthers);
    });
    if (foreign || size > kMost) return false;
    if (said.gone) return known_ && door_.lets_in(prefix_, heard_.from, heard_.now_ns);
    if (!own_guid || !lease || (heard_.secured && !(identity && secure))) return false;
    return known_ = door_.lets_in(prefix_, heard_.from, heard_.now_ns, heard_.secured, kept(said));
  }

  static void cut(Bytes value, bool little) noexcept {
    const auto seconds = static_cast<std::int32_t>(read32(value.data(), little));
    if (seconds >= 0 && seconds < Door::kLease_s) return;
    std::ranges::fill(value, std::uint8_t{0});
    value[little ? 0 : 3] = Door::kLease_s;
  }

  /// The middleware forgets who left, but not where it sent announcements: to one address of each, as our settings ask
  /// for discovery alone by multicast.
  std::uint64_t kept(const Sample& said) const noexcept {
    std::uint64_t addresses = 0;
    each(said.list, said.little, [&](std::uint16_t pid, Bytes value, std::uint8_t*) {
      if (pid != kPidUnicast || value.size() != 24 || read32(value.data(), said.little) != kUdpV4) return;
      const std::uint32_t address = read32(&value[20], false), port = read32(&value[4], said.little);
      addresses = addresses * 31 + (std::uint64_t{address} << 16 | (port & 0xffff));
    });
    return addresses ? addresses : std::uint64_t{heard_.from.address} << 16 | heard_.from.port;
  }

  /// A parameter's text, as the middleware reads it: up to the first zero.
  static std::string_view text(Bytes value, bool little) noexcept {
    if (value.size() < 4) return {};
    const std::size_t size = std::min<std::size_t>(read32(value.data(), little), value.size() - 4);
    const std::string_view all(reinterpret_cast<const char*>(value.data()) + 4, size);
    return all.substr(0, all.find('\0'));
  }

  bool endpoint(Sample said) noexcept {
    std::size_t size = 0;
    Bytes guid;
    bool foreign = false, wanted = said.gone;
    const auto look = [&](std::uint16_t pid, Bytes value, std::uint8_t*) {
      if (pid != kPidPad) size += 4 + value.size();
      if (pid == kPidTopic) wanted |= door_.wants(text(value, said.little));
      if ((pid == kPidEndpoint || (pid == kPidKey && guid.empty())) && own(value)) guid = value;
      foreign |= pid == kPidEndpoint && !own(value);
    };
    each(said.inline_qos, said.little_qos, look);
    each(said.list, said.little, look);
    if (foreign || guid.empty()) return false;
    auto taken = Door::Endpoint::never;
    if (wanted) taken = door_.takes_endpoint(prefix_, read32(&guid[kPrefix], false), said.gone, heard_.now_ns);
    if (taken == Door::Endpoint::later) return false;
    if (taken == Door::Endpoint::yes && size <= kMost) return true;
    each(said.list, said.little, [](std::uint16_t pid, Bytes, std::uint8_t* at) {
      if (pid == kPidTopic) at[0] = at[1] = kPidPad;
    });
    kept_out += wanted;
    return true;
  }

  Door& door_;
  Bytes all_;
  const Heard& heard_;
  std::array<std::uint8_t, kPrefix> prefix_{};
  bool known_ = false, charged_ = false;
};

}  // namespace

std::size_t let_in(Door& door, Bytes datagram, const Heard& heard) noexcept {
  if (datagram.size() < kHeader || std::memcmp(datagram.data(), "RTPS", 4) != 0) return datagram.size();
  Passage passage(door, datagram, heard);
  if (datagram.size() > kHeader && datagram[kHeader] == kProtectedWhole)
    return passage.known() ? datagram.size() : kHeader;
  for (std::size_t at = kHeader; at + kSubmessageHeader <= datagram.size();) {
    std::uint8_t& id = datagram[at];
    const std::uint8_t flags = datagram[at + 1];
    const std::size_t left = datagram.size() - at - kSubmessageHeader;
    std::size_t length = read16(&datagram[at + 2], flags & kLittleEndian);
    const bool to_the_end = length == 0 && id != kPad && id != kInfoTimestamp;
    if (to_the_end) length = left;
    if (length > left) return at;
    if (!passage.passes(id, flags, datagram.subspan(at + kSubmessageHeader, length))) {
      ++kept_out;
      if (to_the_end) return at;
      id = kPad;
    }
    at += kSubmessageHeader + length;
  }
  return datagram.size();
}

std::uint64_t kept_out_parts() noexcept { return kept_out; }

}  // namespace backwash::dds
