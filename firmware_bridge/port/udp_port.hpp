// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware_bridge/port/port.hpp"

namespace backwash::firmware_bridge {

/// A UDP socket with one peer, non-blocking. The peer is given, or is the first that sends what begins as a MAVLink
/// frame; nobody else is heard while it speaks. One that was found and is silent for `patience` is let go of: a
/// simulator that is started anew speaks from another port. For simulators and bench set-ups: UDP itself does not
/// authenticate anyone.
class UdpPort {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kPatience{3};  ///< by then the flight has ended

  struct Endpoint {
    std::string address;  ///< numeric IPv4
    std::uint16_t port = 0;
  };

  /// Binds to `local` (port 0: any free one). Errors: address, open. Not real-time.
  static tl::expected<UdpPort, PortError> open(const Endpoint& local, const std::optional<Endpoint>& peer,
                                               Clock::duration patience = kPatience);

  /// One datagram (its excess over `into` is lost), 0 bytes when there is none. Error: lost. Real-time: at most two
  /// non-blocking system calls, no allocation. Its clock is CLOCK_MONOTONIC.
  tl::expected<std::size_t, PortError> read(std::span<std::uint8_t> into) noexcept;

  /// All bytes as one datagram, or 0 when the kernel's buffer is full or no peer is known. Error: lost. Real-time: one
  /// non-blocking system call, no allocation.
  tl::expected<std::size_t, PortError> write(std::span<const std::uint8_t> bytes) noexcept;

  /// Does nothing: a datagram that was written has left.
  void discard_output() noexcept {}

  /// The port that open() bound to.
  std::uint16_t local_port() const noexcept { return local_port_; }

 private:
  UdpPort(FileDescriptor fd, std::uint16_t local_port, bool has_peer, Clock::duration patience) noexcept
      : fd_(std::move(fd)), local_port_(local_port), has_peer_(has_peer), finds_peer_(!has_peer), patience_(patience) {}
  void listen_to_anyone() noexcept;

  FileDescriptor fd_;
  std::uint16_t local_port_;
  bool has_peer_, finds_peer_;
  Clock::duration patience_;
  Clock::time_point heard_{};  ///< the peer, last
};

}  // namespace backwash::firmware_bridge
