// SPDX-License-Identifier: BSD-3-Clause
#include "services/dds/guard/loopback.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netinet/in.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstring>
#include <mutex>

namespace backwash::dds {
namespace {

using Bytes = std::span<std::uint8_t>;

constexpr std::size_t kHeader = 20, kLocator = 24;
constexpr std::uint8_t kData = 0x15, kLittleEndian = 0x01, kInlineQos = 0x02;
constexpr std::uint16_t kSentinel = 1, kMustUnderstand = 0x4000;
constexpr std::uint16_t kUnicast[] = {0x2f, 0x31, 0x32};  // of an endpoint; of a participant's data and discovery
constexpr std::uint32_t kUdpV4 = 1;

std::atomic<bool> alone{false};

bool is_loopback(std::uint32_t address) { return address >> 24 == 127; }

/// This machine's addresses, as the kernel had them at most a second ago.
class OwnAddresses {
 public:
  bool has(std::uint32_t address) noexcept {
    const std::lock_guard lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    if (const bool known = knows(address); known || now < next_) return known;
    next_ = now + std::chrono::seconds(1);
    ask();
    return knows(address);
  }

 private:
  bool knows(std::uint32_t address) const {
    return std::find(all_.begin(), all_.begin() + count_, address) != all_.begin() + count_;
  }
  void ask() {
    ifaddrs* first = nullptr;
    if (getifaddrs(&first) != 0) return;
    count_ = 0;
    for (const ifaddrs* i = first; i && count_ < static_cast<std::ptrdiff_t>(all_.size()); i = i->ifa_next) {
      if (!i->ifa_addr || i->ifa_addr->sa_family != AF_INET) continue;
      sockaddr_in at;
      std::memcpy(&at, i->ifa_addr, sizeof at);
      all_[static_cast<std::size_t>(count_++)] = ntohl(at.sin_addr.s_addr);
    }
    freeifaddrs(first);
  }

  std::mutex mutex_;
  std::array<std::uint32_t, 64> all_{};
  std::ptrdiff_t count_ = 0;
  std::chrono::steady_clock::time_point next_{};
};

bool is_this_machine(std::uint32_t address) {
  static OwnAddresses own;
  return is_loopback(address) || own.has(address);
}

std::uint32_t number(const std::uint8_t* at, std::size_t bytes, bool little) {
  std::uint32_t n = 0;
  for (std::size_t k = 0; k < bytes; ++k) n = n << 8 | at[little ? bytes - 1 - k : k];
  return n;
}

std::size_t rewrite(Bytes list, bool little, IsOurs ours) {
  std::size_t changed = 0;
  for (std::size_t at = 0; at + 4 <= list.size();) {
    const std::uint32_t pid = number(&list[at], 2, little) & ~kMustUnderstand,
                        length = number(&list[at + 2], 2, little);
    if (pid == kSentinel || length > list.size() - at - 4) return changed;
    std::uint8_t* const value = &list[at] + 4;
    if (std::ranges::find(kUnicast, pid) != std::end(kUnicast) && length == kLocator &&
        number(value, 4, little) == kUdpV4) {
      const std::uint32_t address = number(value + 20, 4, false);
      if (!is_loopback(address) && ours(address)) {
        const std::uint8_t there[] = {127, 0, 0, 1};
        std::ranges::copy(there, value + 20);
        ++changed;
      }
    }
    at += 4 + length;
  }
  return changed;
}

/// DATA of a builtin writer, without its header: its list of parameters, empty if it has none.
Bytes parameters(Bytes body, std::uint8_t flags) {
  const bool little = flags & kLittleEndian;
  constexpr std::size_t kFixed = 20;
  if (body.size() < kFixed || (flags & kInlineQos) || (body[11] & 0xc0) != 0xc0) return {};
  const std::size_t payload = 4 + number(&body[2], 2, little) + 4;  // behind the encapsulation
  if (payload > body.size() || payload < 4 || body[payload - 4] != 0 || (body[payload - 3] & ~1) != 2) return {};
  return body.subspan(payload);
}

}  // namespace

void loopback_alone() noexcept { alone = true; }

std::size_t by_loopback(Bytes datagram, IsOurs ours) noexcept {
  if (datagram.size() < kHeader || std::memcmp(datagram.data(), "RTPS", 4) != 0) return 0;
  std::size_t changed = 0;
  for (std::size_t at = kHeader; at + 4 <= datagram.size();) {
    const std::uint8_t id = datagram[at], flags = datagram[at + 1];
    std::size_t length = number(&datagram[at + 2], 2, flags & kLittleEndian);
    if (length == 0 && id == kData) length = datagram.size() - at - 4;
    if (length > datagram.size() - at - 4) return changed;
    if (id == kData) {
      const Bytes list = parameters(datagram.subspan(at + 4, length), flags);
      changed += rewrite(list, !list.empty() && (*(list.data() - 3) & 1), ours);
    }
    at += 4 + length;
  }
  return changed;
}

Door::Source source_of(const msghdr& message) noexcept {
  sockaddr_in from{};
  if (!message.msg_name || message.msg_namelen < sizeof from) return {0, 0};
  std::memcpy(&from, message.msg_name, sizeof from);
  if (from.sin_family != AF_INET) return {0, 0};
  return {alone ? INADDR_LOOPBACK : ntohl(from.sin_addr.s_addr), ntohs(from.sin_port)};
}

std::size_t heard_of(const msghdr& message, Bytes datagram) noexcept {
  if (!alone) return datagram.size();
  sockaddr_in from{};
  if (!message.msg_name || message.msg_namelen < sizeof from) return datagram.size();
  std::memcpy(&from, message.msg_name, sizeof from);
  if (from.sin_family != AF_INET) return datagram.size();
  if (!is_this_machine(ntohl(from.sin_addr.s_addr))) return std::min(datagram.size(), kHeader);
  by_loopback(datagram, is_this_machine);
  return datagram.size();
}

}  // namespace backwash::dds
