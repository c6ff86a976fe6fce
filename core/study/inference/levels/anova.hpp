// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "core/study/windows/observation.hpp"

namespace backwash::study {

/// Variances of a channel, of windows within a flight, of flights, and of units of several flights (none of their own
/// where a unit is a flight).
struct Scatter {
  double within, between, units;
};

/// Scatter between the rotors and sensors of a craft that is no effect and that no number of flights averages out.
double built_scatter(Channel c);

/// Of a channel by analysis of variance: what a fit leaves of it and its weight (0: not measured) in each window, and
/// where the window's flight ends.
Scatter anova(Channel c, std::span<const double> residual, std::span<const double> weight, const Units& of,
              std::span<const std::size_t> flight_end);

}  // namespace backwash::study
