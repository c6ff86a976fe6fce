// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/study/discrepancy/search.hpp"

namespace backwash::study::discrepancy {

/// Fits an accepted cause given the others' columns: the scale between the grid's points (parabola of the likelihood
/// over a finer grid), the parameters, and their intervals with the scale refitted without each flight. Sets scale,
/// columns, theta, gain and parameters.
void refine(const Evidence& evidence, Accepted& cause, const std::vector<Column>& others);

/// Whether the 95 % interval of some parameter, by leaving flights out at this scale, excludes 0. The scale's own error
/// is no part of it: where a scale cannot be told, a size extrapolated to its reference can, with every scale, be of
/// one sign.
bool excludes_zero(const Normal& normal, const std::vector<Column>& columns);

/// Quantile 0.975 of Student's t.
double student_975(double degrees);

}  // namespace backwash::study::discrepancy
