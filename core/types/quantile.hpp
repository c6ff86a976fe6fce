// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace backwash {

/// The value of which a share of the others, 0 … 1, is no larger: the one at place share (n − 1), rounded, of n in
/// order. With 0.5 the middle one, of an even count the upper one of the two. Needs one value at least, none of them
/// NaN. O(n) on average.
inline double quantile(std::vector<double> values, double share) {
  const auto place = std::lround(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + place, values.end());
  return values[static_cast<std::size_t>(place)];
}

}  // namespace backwash
