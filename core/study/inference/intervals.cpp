// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/intervals.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::study {

double student_975(double n) {
  // Cornish–Fisher about the normal quantile; below 0.2 % off from 5 degrees up.
  const double z = 1.959964, z3 = z * z * z, z5 = z3 * z * z, z7 = z5 * z * z;
  return z + (z3 + z) / (4 * n) + (5 * z5 + 16 * z3 + 3 * z) / (96 * n * n) +
         (3 * z7 + 19 * z5 + 17 * z3 - 15 * z) / (384 * n * n * n);
}

Estimate averaged(const std::string& name, const std::vector<Guess>& guesses) {
  double total = 0, value = 0, low = guesses.front().value, high = low;
  for (const auto& g : guesses) {
    total += g.weight, value += g.weight * g.value;
    low = std::min(low, g.value - 6 * g.error), high = std::max(high, g.value + 6 * g.error);
  }
  value /= total;
  const auto quantile = [&](double p) {
    double a = low, b = high;
    for (int i = 0; i < 60; ++i) {
      const double q = (a + b) / 2;
      double below = 0;
      for (const auto& g : guesses)
        below +=
            g.weight / total * (g.error > 0 ? 0.5 * std::erfc((g.value - q) / g.error / std::sqrt(2.0)) : q >= g.value);
      (below < p ? a : b) = q;
    }
    return (a + b) / 2;
  };
  return {name, value, quantile(0.025), quantile(0.975)};
}

}  // namespace backwash::study
