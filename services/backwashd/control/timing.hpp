// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace backwash::daemon {

/// Distribution of a time: counts in buckets that grow by 2^(1/8) (9 %) from 0.25 µs to about a minute, and the exact
/// maximum. Fixed size, trivially copyable. Real-time: wait-free, no allocation.
struct TimingHistogram {
  static constexpr int kPerOctave = 8, kBuckets = 224;
  static constexpr double kFirst = 0.25;  ///< µs
  std::array<std::uint32_t, kBuckets> counts{};
  std::uint64_t total = 0;
  double max_us = 0;

  void add(double us) noexcept {
    const double octaves = us > kFirst ? std::log2(us / kFirst) : 0;
    ++counts[static_cast<std::size_t>(std::min<double>(kBuckets - 1, octaves * kPerOctave))];
    ++total;
    max_us = std::max(max_us, us);
  }
  /// Upper end of the bucket that holds the quantile q, at most the maximum, µs; 0 when empty.
  double quantile(double q) const noexcept {
    const double wanted = q * static_cast<double>(total);
    double seen = 0;
    for (int b = 0; b < kBuckets; ++b) {
      seen += counts[static_cast<std::size_t>(b)];
      if (seen > 0 && seen >= wanted) return std::min(max_us, kFirst * std::exp2((b + 1.0) / kPerOctave));
    }
    return max_us;
  }
};

}  // namespace backwash::daemon
