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
/// fastest one, and what the two clocks drift apart by is followed up to 100 ppm, by time. Real-time: wait-free, no
/// allocation.
class SenderClock {
 public:
  /// When the sample was taken, CLOCK_MONOTONIC ns, never after its reception.
  std::int64_t taken_ns(std::int64_t stamp_ns, std::int64_t received_ns) noexcept {
    const std::int64_t difference = received_ns - stamp_ns;
    if (difference >= 0 && difference < kSame_ns) return stamp_ns;
    const bool stepped = offset_ns_ && difference > *offset_ns_ + kStep_ns;  // the sender's clock was set
    if (!offset_ns_ || stepped)
      offset_ns_ = difference;
    else  // whatever the rate: as fast as clocks drift apart, no faster than the samples' ways allow
      offset_ns_ = std::min(difference, *offset_ns_ + std::max(received_ns - last_ns_, std::int64_t{0}) / kDrift);
    last_ns_ = received_ns;
    return std::min(stamp_ns + *offset_ns_, received_ns);
  }

 private:
  static constexpr std::int64_t kSame_ns = 1'000'000'000, kStep_ns = 200'000'000;
  static constexpr std::int64_t kDrift = 10'000;  // one part in so many, 100 ppm: what two crystals differ by at most
  std::optional<std::int64_t> offset_ns_;
  std::int64_t last_ns_ = 0;  // reception of the sample that offset_ns_ is of
};

}  // namespace backwash::daemon
