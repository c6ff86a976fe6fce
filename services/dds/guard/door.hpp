// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>
#include <string>
#include <string_view>

/// Whom the middleware may get to know. It keeps something for each participant that is announced to it and for each of
/// its endpoints, as long as the announcement says, and asks nobody whether they exist (docs/faults.md row 26).
namespace backwash::dds {

/// A bucket of tokens in one number: when it will be full. Any thread.
class Allowance {
 public:
  /// False: `cost_ns` of time would be more than `burst_ns` ahead of now.
  bool has(std::int64_t now_ns, std::int64_t cost_ns, std::int64_t burst_ns) const noexcept;
  /// The same; if it has them, they are taken.
  bool take(std::int64_t now_ns, std::int64_t cost_ns, std::int64_t burst_ns) noexcept;

 private:
  std::atomic<std::int64_t> full_ns_{0};
};

/// The law of who is let in. A participant is known by the prefix that all its GUIDs have. One that is known is heard
/// as long as it is not silent for kLease_s; all others are let in one by one, and so many a second. Each count is for
/// one socket (address and port), for one address, and in all: who floods from one place takes no other's. Where no
/// place is left, the one that was let in first of those that the middleware never connected with a topic of ours is
/// forgotten; one that is connected and not silent for kSilent_s loses its place to nobody. With DDS Security only who
/// has credentials is connected. All times are ns of one clock that rises. Any thread; where a thread of the middleware
/// asks, nothing allocates or waits: beside another caller a stranger may be refused.
class Door {
 public:
  /// Identity of a participant, 12 bytes, and what it is reduced to here, by a secret of the process: of those that
  /// are let in no two are alike.
  using Prefix = std::span<const std::uint8_t, 12>;
  /// Where datagrams come from: an IPv4 address, and a port.
  struct Source {
    std::uint32_t address;
    std::uint16_t port;
  };

  static constexpr std::int64_t kSecond_ns = 1'000'000'000;
  static constexpr std::int64_t kLease_s =
      40;  ///< what others announce is cut to it; 30 s between announcements is seen
  static constexpr std::int64_t kSilent_s = 10;
  static constexpr std::size_t kLiving = 128, kOfAddress = 96, kOfSocket = 8;
  static constexpr std::int64_t kNew = 5, kNewOfAddress = 3;        ///< a second
  static constexpr std::int64_t kFirst = 64, kFirstOfAddress = 48;  ///< at once, after a rest
  /// Who announces one after the other from one socket is heard no more for a while: a process has one or two.
  static constexpr std::int64_t kFirstOfSocket = 8, kNextOfSocket_s = 5, kDebtOfSocket_s = 60;
  static constexpr std::int64_t kAgain = 10, kAgainFirst = 40;  ///< announcements of one
  /// Endpoints of topics of ours: these of each participant have their place, of all others of it and of all so many.
  static constexpr std::size_t kSureOfOne = 8, kEndpointsOfOne = 256, kShared = 1024;
  static constexpr std::size_t kEndpoints = kLiving * kSureOfOne + kShared;
  static constexpr std::int64_t kAddresses = 256, kNextAddress_s = 10;
  static constexpr std::int64_t kBytes = 16 << 10, kFirstBytes = 256 << 10;  ///< discovery of one, a second
  static constexpr std::int64_t kBytesOfStrangers = 64 << 10, kFirstBytesOfStrangers = 1 << 20;

  explicit Door(std::uint64_t secret) noexcept : secret_(secret) {}

  /// A datagram of this participant came. False: it is unknown, or was silent for too long.
  bool knows(Prefix prefix, std::int64_t now_ns) noexcept;
  /// It is announced. True: the middleware may see the announcement. One that begins a handshake costs twice the
  /// memory, and counts as two. `kept`: the address to which the middleware will send its own announcements until the
  /// process ends, as a number, each new one counted, of one that is known as well; 0: it names none.
  bool lets_in(Prefix prefix, const Source& from, std::int64_t now_ns, bool handshake = false,
               std::uint64_t kept = 0) noexcept;
  /// It sends `bytes` of discovery beyond its announcement. What is out of order is kept until the rest has come.
  bool takes(Prefix prefix, std::size_t bytes, std::int64_t now_ns) noexcept;
  /// Before a participant of this process is made: the topics that it will ever have, by their whole names. Endpoints
  /// of others concern nobody here, and are not counted. None: it may have any.
  void wants(std::span<const std::string> topics) noexcept;
  bool wants(std::string_view topic) const noexcept;
  /// It announces one of its endpoints, of a topic of ours, or that this is gone. `later`: as if it had been lost on
  /// its way, so that it comes again; `never`: it has too many.
  enum class Endpoint { yes, later, never };
  Endpoint takes_endpoint(Prefix prefix, std::uint32_t entity, bool gone, std::int64_t now_ns) noexcept;
  /// The middleware has connected it with a topic of ours.
  void met(Prefix prefix, std::int64_t now_ns) noexcept;
  /// It is of this process: known until it is gone().
  void ours(Prefix prefix, std::int64_t now_ns) noexcept;
  void gone(Prefix prefix) noexcept;
  /// Who is known now.
  std::size_t living(std::int64_t now_ns) const noexcept;

 private:
  struct Place {
    std::atomic<std::uint64_t> key{0};
    std::atomic<std::int64_t> until_ns{INT64_MIN};
    std::atomic<bool> friendly{false};
    Allowance announcements, bytes;
    std::atomic<std::uint32_t> socket{0};
    std::uint64_t of_socket{}, of_address{};
    std::atomic<std::uint64_t> kept{0};
    std::int64_t since_ns = 0;
    std::size_t endpoints = 0;
  };
  struct Known {
    std::uint64_t key;
    Place* place;
    std::int64_t until_ns;  // of one whose participant has lost its place: when the middleware forgets it
  };
  struct Socket {
    std::atomic<std::int64_t> full_ns{0};
    std::atomic<std::uint32_t> last{0};  // who was announced from there
  };
  static constexpr std::size_t kBuckets = 1024, kSockets = 1 << 16;  // a few share one
  static constexpr std::size_t kTopics = 64, kAllTopics = kTopics + 1;

  std::uint64_t secret(std::uint64_t value) const noexcept;
  std::uint64_t key(Prefix prefix) const noexcept;
  std::uint64_t key(std::string_view topic) const noexcept;
  bool has_kept(std::uint64_t address) const noexcept;
  void keep(Place& place, std::uint64_t address) noexcept;
  static bool announces(Socket& socket, std::uint64_t key, std::int64_t now_ns) noexcept;
  Place* find(std::uint64_t key, std::int64_t now_ns) noexcept;
  Place* room(std::uint64_t of_socket, std::uint64_t of_address, std::int64_t now_ns) noexcept;
  Place* first_to_go(std::uint64_t of_socket, std::uint64_t of_address, std::int64_t now_ns) noexcept;
  void settle(Place& place, std::uint64_t key, std::int64_t now_ns) noexcept;

  const std::uint64_t secret_;
  std::mutex mutex_;  // who settles, and endpoints
  std::array<Place, kLiving> places_;
  std::array<Known, kEndpoints> endpoints_{};
  std::array<std::atomic<std::uint64_t>, kTopics> topics_{};
  std::atomic<std::size_t> topics_known_{0};
  std::array<std::uint64_t, 4 * kAddresses> addresses_{};  // a flood of new ones does not soon displace the others
  std::size_t next_address_ = 0;
  Allowance in_all_, strangers_bytes_, kept_;
  std::array<Allowance, kBuckets> nets_, sockets_bytes_;
  std::array<Socket, 2 * kSockets> sockets_;
};

}  // namespace backwash::dds
