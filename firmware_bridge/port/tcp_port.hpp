// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware_bridge/port/port.hpp"

namespace backwash::firmware_bridge {

/// A TCP connection that we open, non-blocking. For simulators and bench set-ups: TCP itself authenticates nobody.
class TcpPort {
 public:
  /// Connects to a numeric IPv4 address, waiting at most `patience`. Errors: address, open. Not real-time.
  static tl::expected<TcpPort, PortError> open(const std::string& address, std::uint16_t port,
                                               std::chrono::milliseconds patience);

  /// Bytes at hand, 0 when there are none. Error: lost, also when the peer has closed. Real-time: one non-blocking
  /// system call, no allocation.
  tl::expected<std::size_t, PortError> read(std::span<std::uint8_t> into) noexcept;

  /// Number of bytes that the kernel took, possibly fewer than given, 0 when its buffer is full. Error: lost.
  /// Real-time: one non-blocking system call, no allocation.
  tl::expected<std::size_t, PortError> write(std::span<const std::uint8_t> bytes) noexcept;

  /// Does nothing: a connection cannot take back what the kernel holds. Its buffer is kept small instead.
  void discard_output() noexcept {}

 private:
  explicit TcpPort(FileDescriptor fd) noexcept : fd_(std::move(fd)) {}
  FileDescriptor fd_;
};

}  // namespace backwash::firmware_bridge
