// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/plan/search/kinodynamic_astar.hpp"
#include "core/plan/spline/spline_cost.hpp"

namespace backwash::plan {

struct OptimizerResult {
  BSpline spline;
  double cost;  ///< f of the best point seen
  std::size_t evaluations;
  bool converged;  ///< false: evaluations or time ran out, or a line search failed; more may be gained from here
};
/// Minimises by NLopt's L-BFGS from the initial spline, in variables that make f_s well conditioned (five to fifteen
/// times less jerk for the same evaluations), f scaled so that |g_0|_∞ = 0.1, until it converges, `max_evaluations` or
/// the deadline. Never worse than the start.
OptimizerResult optimise(const SplineCost& cost, std::size_t max_evaluations, Clock::time_point deadline);

}  // namespace backwash::plan
