// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <tl/expected.hpp>

#include "firmware_bridge/mavlink/frame.hpp"
#include "firmware_bridge/port/port.hpp"

namespace backwash::firmware_bridge {

/// Frames that wait for the port, oldest first. Never blocks, never grows: a new set-point takes the place of one that
/// still waits and of an ODOMETRY before it, a new ODOMETRY that of one that waits, and a frame for which there is no
/// room that of the oldest. So a set-point waits for no ODOMETRY but one of which a part is on the wire: that is
/// finished, as any such frame, so that what follows it stays readable. Real-time: no allocation.
class TransmitQueue {
 public:
  static constexpr std::size_t kCapacity = 16;

  enum class Kind { setpoint, odometry, other };

  void push(const mavlink::EncodedFrame& frame, Kind kind) noexcept;

  /// Writes what write(span) takes: it returns the number of bytes taken (0: try later) or a PortError, passed on.
  template <class Write>
  tl::expected<void, PortError> flush(Write&& write) noexcept {
    while (count_ > 0) {
      const auto taken = write(frames_[0].frame.view().subspan(head_written_));
      if (!taken) return tl::unexpected(taken.error());
      head_written_ += *taken;
      if (head_written_ < frames_[0].frame.length) return {};
      finish_head();
    }
    return {};
  }

  /// Forgets everything, also the rest of a frame of which a part is on the wire.
  void clear() noexcept;

  std::size_t waiting() const noexcept { return count_; }
  std::uint64_t sent() const noexcept { return sent_; }
  /// Frames that gave way to newer ones.
  std::uint64_t dropped() const noexcept { return dropped_; }
  /// Set-points in a row that were not wholly written when the next one came (docs/faults.md row 20).
  int missed_setpoints() const noexcept { return missed_setpoints_; }

 private:
  struct Entry {
    mavlink::EncodedFrame frame;
    Kind kind = Kind::other;
  };
  void finish_head() noexcept;
  void remove(std::size_t index) noexcept;

  std::array<Entry, kCapacity> frames_{};
  std::size_t count_ = 0;
  std::size_t head_written_ = 0;  // bytes of frames_[0] that the port took
  std::uint64_t sent_ = 0, dropped_ = 0;
  int missed_setpoints_ = 0;
};

}  // namespace backwash::firmware_bridge
