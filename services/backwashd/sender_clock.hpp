// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

namespace backwash::daemon {

/// The stamps of an odometry sender in our own monotonic clock, which is the one our answers to TIMESYNC tell the
/// autopilot: it takes the time of ODOMETRY to be in that. A sender on the same clock (its samples are less than 1 s
/// old and not of the future) keeps its stamps. Of another one, on wall time say, the least difference of reception and
/// stamp is taken for the offset: a sample then counts as older than its reception by what it took longer than the
/// fastest one. Real-time: wait-free, no allocation.
class SenderClock {
 public:
  /// When the sample was taken, CLOCK_MONOTONIC ns, never after its reception.
  std::int64_t taken_ns(std::int64_t stamp_ns, std::int64_t received_ns) noexcept {
    const std::int64_t difference = received_ns - stamp_ns;
    if (difference >= 0 && difference < kSame_ns) return stamp_ns;
    const bool stepped = offset_ns_ && difference > *offset_ns_ + kStep_ns;  // the sender's clock was set
    if (!offset_ns_ || stepped || difference < *offset_ns_)
      offset_ns_ = difference;
    else
      *offset_ns_ += kDrift_ns;
    return std::min(stamp_ns + *offset_ns_, received_ns);
  }

 private:
  static constexpr std::int64_t kSame_ns = 1'000'000'000, kStep_ns = 200'000'000;
  static constexpr std::int64_t kDrift_ns = 2'000;  // a sample: 100 ppm at 50 Hz
  std::optional<std::int64_t> offset_ns_;
};

}  // namespace backwash::daemon
