// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "core/study/inference/rules.hpp"

namespace backwash::study {

/// P(|N(mean, variance)| ≤ limit): the share of a Gaussian's samples that a bound holds.
inline double share_within(double mean, double variance, double limit) {
  const double s = std::sqrt(2 * std::max(variance, kRules.least_variance.value));
  return 0.5 * (std::erf((limit - mean) / s) + std::erf((limit + mean) / s));
}

/// The same of the central 90 % of N(0, model).
inline double share_of_interval(double mean, double variance, double model) {
  return share_within(mean, variance, kRules.normal_95 * std::sqrt(model));
}

}  // namespace backwash::study
