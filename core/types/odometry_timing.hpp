// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/types/geometry.hpp"

namespace backwash {

/// How often odometry comes at least, and how old it is when it comes, as the configuration states it (docs/model.md,
/// 4-13 to 4-15). Of the usual timing nothing is added to any age, set or window.
struct OdometryTiming {
  static constexpr double kUsual = 20;  ///< Hz; from this rate on gaps are what the vehicle file's first set holds
  /// s without a good sample at kUsual until HOLD (docs/faults.md row 1): the gap, and 30 ms of lateness.
  static constexpr double kHoldAfter = 0.08;
  double rate_least = kUsual;  ///< Hz, > 0: below it nothing is enabled
  double latency = 0;          ///< s from a pose to the fastest reception of it, ≥ 0

  /// The gap between two samples beyond that of kUsual, s.
  double longer_gap() const noexcept { return rate_least < kUsual ? 1 / rate_least - 1 / kUsual : 0; }
  /// Samples of kUsual in one gap, ≥ 1.
  double usual_samples() const noexcept { return std::max(1.0, kUsual / rate_least); }
  bool usual() const noexcept { return rate_least >= kUsual && latency == 0; }
  /// Age of the oldest pose that is flown by, s: then HOLD.
  double oldest() const noexcept { return kHoldAfter + longer_gap() + latency; }
  /// Commands at rest before a new segment moves: as long as its first pose may be old (4-14).
  std::size_t lead() const noexcept {
    return usual() ? 0 : static_cast<std::size_t>(std::ceil(oldest() / kControlPeriod)) + 1;
  }
};

}  // namespace backwash
