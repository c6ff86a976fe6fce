// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bit>
#include <cstdint>
#include <limits>

namespace backwash::reach {

/// A bound in 16 bits, never below it (docs/model.md section 3): 5 bits of exponent and 11 of mantissa, 0 for none.
/// Codes have the order of what they stand for: the largest of some codes is the code of the largest bound.
using BoundCode = std::uint16_t;

constexpr double kLeastBound = 0x1p-15;                             ///< m/s²: smaller ones but 0 count as that
constexpr double kLargestBound = 0x1.ffcp15;                        ///< m/s²: larger ones count as infinite
constexpr double kBoundGrowth = 0x1p-11;                            ///< by this share of itself at most a bound grows
constexpr auto kUnbounded = std::numeric_limits<BoundCode>::max();  ///< an infinite bound

namespace bound_code {
constexpr int kMantissa = 11;                // bits
constexpr int kDropped = 52 - kMantissa;     // bits of a double's mantissa that a code has not
constexpr std::uint64_t kBelow = 1023 - 16;  // the double's exponents below those of a code
}  // namespace bound_code

/// The code of a bound w ≥ 0, m/s², rounded up: bound_of() gives w to w·(1 + kBoundGrowth), and exactly 0 for 0. What
/// is not a number is unbounded. Real-time: wait-free, no allocation.
inline BoundCode code_of(double w) noexcept {
  if (!(w <= kLargestBound)) return kUnbounded;
  if (!(w > 0)) return 0;
  const auto bits = std::bit_cast<std::uint64_t>(w < kLeastBound ? kLeastBound : w);
  const std::uint64_t up = (bits + ((std::uint64_t{1} << bound_code::kDropped) - 1)) >> bound_code::kDropped;
  return static_cast<BoundCode>(up - (bound_code::kBelow << bound_code::kMantissa));
}

/// The bound of a code, m/s². Exact: the code's bits as those of a double, times a power of two. Real-time: wait-free,
/// no allocation, no branch.
inline double bound_of(BoundCode code) noexcept {
  const double small = std::bit_cast<double>(std::uint64_t{code} << bound_code::kDropped);  // 0 or normal
  constexpr double kScale[] = {0x1p1007, std::numeric_limits<double>::infinity()};
  return small * kScale[code == kUnbounded];
}

}  // namespace backwash::reach
