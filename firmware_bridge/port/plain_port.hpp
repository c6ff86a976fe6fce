// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware_bridge/mavlink/frame.hpp"
#include "firmware_bridge/mavlink/messages.hpp"
#include "firmware_bridge/plain/plain.h"
#include "firmware_bridge/port/serial_port.hpp"

namespace backwash::firmware_bridge {

/// HEARTBEAT.autopilot that stands for a controller behind a PlainPort. No MAVLink autopilot has this number.

/// A serial line to a controller that speaks the plain link (docs/plain_link.md), as a port of MAVLink frames: what
/// AutopilotLink writes is put on the line as plain frames, and what the controller says is read as MAVLink frames. So
/// everything above it, from telemetry to the raw log, is the same for both. What the plain link has no frame for is
/// not sent: TIMESYNC, STATUSTEXT, parameters, message intervals.
///
/// A plain frame that is refused reads as a HEARTBEAT with a wrong checksum: it counts, and names a wrong baud rate.
class PlainPort {
 public:
  /// `system`: what the controller is called as a MAVLink system.
  PlainPort(SerialPort line, std::uint8_t system) noexcept : line_(std::move(line)), system_(system) {}

  /// MAVLink frames of what has arrived, 0 bytes when there is nothing. `into` has room for kLargestRead. Error: lost.
  /// Real-time: a bounded number of non-blocking system calls, no allocation.
  static constexpr std::size_t kLargestRead = 2048;
  tl::expected<std::size_t, PortError> read(std::span<std::uint8_t> into) noexcept;

  /// One MAVLink frame or a part of it: all its bytes, or 0 while the kernel has not taken the plain frame before.
  /// Error: lost. Real-time: two non-blocking system calls, no allocation.
  tl::expected<std::size_t, PortError> write(std::span<const std::uint8_t> bytes) noexcept;

  /// Forgets what the kernel has not sent yet. A frame cut on the line is refused there by its checksum.
  void discard_output() noexcept;

 private:
  struct Question {
    std::uint16_t sequence = 0, command = 0;  // MAV_CMD
  };
  void take(const mavlink::Frame& frame) noexcept;
  void take(const mavlink::SetPositionTargetLocalNed& m) noexcept;
  void take(const mavlink::Odometry& m) noexcept;
  void take(const mavlink::CommandLong& m) noexcept;
  void ask(std::uint8_t request) noexcept;
  tl::expected<void, PortError> flush() noexcept;
  void tell(const plain_state_t& state, std::span<std::uint8_t>& into) noexcept;
  void tell_pose(const plain_state_t& state, std::span<std::uint8_t>& into) noexcept;
  void tell_refused(std::span<std::uint8_t>& into) noexcept;
  template <class Message>
  void tell(const Message& message, std::span<std::uint8_t>& into) noexcept;

  SerialPort line_;
  std::uint8_t system_, mavlink_sequence_ = 0;
  mavlink::Parser parser_;  // of what is written
  std::uint16_t sequence_ = 0;
  std::array<std::uint8_t, PLAIN_LARGEST_SIZE> out_{};
  std::size_t out_begin_ = 0, out_end_ = 0;  // not yet taken by the kernel
  std::optional<Question> open_;             // not answered yet
  plain_receiver_t receiver_{};
  std::size_t since_frame_ = 0;  // bytes
  std::optional<std::uint16_t> last_state_;
};

}  // namespace backwash::firmware_bridge
