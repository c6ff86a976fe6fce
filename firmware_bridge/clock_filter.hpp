// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace backwash::firmware_bridge {

/// Clock of the flight controller against ours, from TIMESYNC.
struct ClockOffset {
  std::int64_t offset_ns = 0;      ///< controller's time − our monotonic time
  std::int64_t round_trip_ns = 0;  ///< of the exchange; the offset is good to half of it
};

/// The offset of another clock by minimum delay: of the last exchanges the one with the shortest round trip is
/// believed, because what lengthens a round trip waits on one of its two ways and falsifies the offset by half of that.
/// Real-time: no allocation.
class ClockFilter {
 public:
  static constexpr std::size_t kKept = 16;  ///< exchanges; at 2 Hz a clock drifts by 0.4 ms in them at 50 ppm
  static constexpr std::int64_t kDrift_ns =
      5'000'000;  ///< two offsets further apart than their own errors and this:
                  ///< the other clock began anew, and what came before is forgotten
  void add(const ClockOffset& exchange) noexcept;
  /// Absent before the first exchange.
  std::optional<ClockOffset> best() const noexcept;
  /// The shortest round trip of the newest `exchanges` ≤ kKept, ns; absent: there were not so many.
  std::optional<std::int64_t> shortest(std::size_t exchanges) const noexcept;

 private:
  std::array<ClockOffset, kKept> kept_{};
  std::size_t count_ = 0, next_ = 0;
};

}  // namespace backwash::firmware_bridge
