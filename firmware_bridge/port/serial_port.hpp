// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware_bridge/port/port.hpp"

namespace backwash::firmware_bridge {

/// A serial line or pseudo-terminal: raw, 8N1, no flow control, non-blocking, held exclusively.
class SerialPort {
 public:
  /// Opens and configures `path` at `baud` bit/s, any rate that the device comes within 2.5 % of; asks its driver for
  /// low latency; discards what was received before. Errors: open, busy, not_serial, baud_rate, configure. Not
  /// real-time.
  static tl::expected<SerialPort, PortError> open(const std::string& path, unsigned baud);

  /// Bytes at hand, 0 when there are none. Error: lost. Real-time: one non-blocking system call, no allocation.
  tl::expected<std::size_t, PortError> read(std::span<std::uint8_t> into) noexcept;

  /// Number of bytes that the kernel took, possibly fewer than given, 0 when its buffer is full. Error: lost.
  /// Real-time: one non-blocking system call, no allocation.
  tl::expected<std::size_t, PortError> write(std::span<const std::uint8_t> bytes) noexcept;

  /// Forgets what the kernel has not sent yet. Real-time: one system call.
  void discard_output() noexcept;

 private:
  explicit SerialPort(FileDescriptor fd) noexcept : fd_(std::move(fd)) {}
  FileDescriptor fd_;
};

}  // namespace backwash::firmware_bridge
