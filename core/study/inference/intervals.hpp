// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "core/study/effects/effect.hpp"

namespace backwash::study {

/// What one model says of a quantity: its weight among the models, value and standard error.
struct Guess {
  double weight, value, error;
};
/// Model-averaged value, and interval at 95 % by model-averaged tail areas (Turek and Fletcher, Computational
/// Statistics and Data Analysis 56, 2012): its ends leave 2.5 % of Σ w N(value, error) outside each. Weights need no
/// sum of 1; one guess: value ± 1.96 error.
Estimate averaged(const std::string& name, const std::vector<Guess>& guesses);

/// Quantile 0.975 of Student's t.
double student_975(double degrees);

}  // namespace backwash::study
