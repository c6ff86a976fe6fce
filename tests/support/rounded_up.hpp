// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

namespace backwash {

/// The least number of 12 significant bits that is not below w ≥ 0, by arithmetic and not by bits.
inline double rounded_up(double w) {
  int exponent = 0;
  const double mantissa = std::frexp(w, &exponent);
  return std::ldexp(std::ceil(std::ldexp(mantissa, 12)), exponent - 12);
}

}  // namespace backwash
