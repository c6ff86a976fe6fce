// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/study/inference/intervals.hpp"
#include "core/study/inference/search.hpp"

namespace backwash::study {

/// Fits an accepted cause given the others' columns. Sets the scale (the likelihood's maximum: best point of a grid,
/// then NLopt), columns, theta and gain of the cause's own form, which field, reach and plan evaluate; and the
/// parameters with their intervals, which are averaged over every shape of the cause (Form::shapes) and every scale
/// that the data do not reject. A map offset is fitted along x and y.
void refine(const Evidence& evidence, Accepted& cause, const std::vector<DesignColumn>& others);

/// Whether the 95 % interval of some parameter, by leaving flights out at this scale, excludes 0. The scale's own error
/// is no part of it: where a scale cannot be told, a size extrapolated to its reference can, with every scale, be of
/// one sign.
bool excludes_zero(const NormalEquations& normal, const std::vector<DesignColumn>& columns);

}  // namespace backwash::study
