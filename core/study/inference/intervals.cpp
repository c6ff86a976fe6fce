// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/intervals.hpp"

#include <algorithm>
#include <cmath>

#include "core/study/inference/rules.hpp"
#include "core/study/windows/signals/distributions.hpp"
#include "core/types/normal.hpp"

namespace backwash::study {

double student_975(double degrees) { return student_quantile(1 - kRules.tail, degrees); }

Estimate averaged(const std::string& name, const std::vector<Guess>& guesses) {
  double total = 0, value = 0, low = guesses.front().value, high = low;
  for (const auto& g : guesses) {
    total += g.weight;
    value += g.weight * g.value;
    low = std::min(low, g.value - kRules.mixture_reach * g.error);
    high = std::max(high, g.value + kRules.mixture_reach * g.error);
  }
  value /= total;
  const auto quantile = [&](double p) {
    double a = low, b = high;
    for (int i = 0; i < kRules.mixture_turns; ++i) {
      const double q = (a + b) / 2;
      double below = 0;
      for (const auto& g : guesses)
        below += g.weight / total * (g.error > 0 ? normal::below((q - g.value) / g.error) : q >= g.value);
      (below < p ? a : b) = q;
    }
    return (a + b) / 2;
  };
  return {name, value, quantile(kRules.tail), quantile(1 - kRules.tail)};
}

}  // namespace backwash::study
