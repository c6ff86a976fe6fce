// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/study/inference/search.hpp"

namespace backwash::study {

/// Whether the craft hovers where a push would hold it. A position loop without an integrator rests off its set-point
/// by push/k_p, one with an integrator on it. `slope`: measured over predicted shift in the hovers, 1 as predicted,
/// with its 95 % interval by leaving flights out.
struct ShiftCheck {
  double slope = 0, low = 0, high = 0;
  double predicted = 0, measured = 0;  ///< root mean squares over those hovers, m
  bool tested = false;                 ///< the interval is narrower than 1
  /// The log refutes the shift: less than half of it is there. The planner then takes the push for one of unknown sign
  /// in its bound, and leaves the centre where the set-point is.
  bool refuted() const;
};

/// Of a cause's pushes in the windows of hover, where set-points say where the craft should be. `beside`: coefficients
/// of the form's companions. Not tested without such windows in 3 flights, or below 2 mm of predicted shift,
/// nor what a sensor alone tells, nor of a vehicle file with an integrator: it predicts no shift.
ShiftCheck check_shift(const Accepted& cause, const std::vector<double>& beside, const Observations& seen);

}  // namespace backwash::study
