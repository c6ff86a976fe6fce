// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/study/windows/gates/rule.hpp"

namespace backwash::study::calibrate {

/// Every constant that decides what calibration says, beside the options that a caller may set (`backwash study
/// --rules`). Members are rules and nothing else.
struct CalibrationRules {
  // clang-format off
  // Fit
  Rule quantile{"quantile", 0.9, "of windows", "chosen: the bound's, unless told otherwise"};
  Rule fit_rounds{"fit_rounds", 3, "rounds", "chosen: of flights' levels and bound in turn"};
  Rule smoothing{"smoothing", 0.05, "ln variance", "chosen: of the pinball loss, an eighth of a window's scatter"};
  Rule least_base{"least_base", 1e-6, "(m/s²)²", "derived: keeps ln Σ finite"};
  Rule least_decay{"least_decay", 0.3, "1/m²", "derived: half of the effect is left at 1.5 m, where the gates end"};
  Rule largest_decay{"largest_decay", 50, "1/m²", "derived: half is left at 0.12 m, nearer than a hull comes"};
  Rule decays{"decays", 16, "1", "derived: of the grid between which features are interpolated"};
  Rule decay_ratio{"decay_ratio", 1.42, "1", "derived: 16 stored decays reach from 0.3 to 58 1/m²"};
  Rule first_decay{"first_decay", 3, "1/m²", "derived: of the shipped model; amplitudes are scaled there, no answer"};
  Rule largest_scaled{"largest_scaled", 1e4, "1", "derived: an amplitude is of order 1 when scaled"};
  Rule rough_tolerance{"rough_tolerance", 1e-7, "of the loss", "chosen: before flights' levels are told anew"};
  Rule fine_tolerance{"fine_tolerance", 1e-9, "of the loss", "derived: changes no digit that is told"};
  Rule evaluations{"evaluations", 400, "evaluations", "chosen: of NLopt; the best point seen stands"};
  Rule least_between{"least_between", 1e-3, "ln variance", "derived: so that it can be divided by"};
  Rule level_range{"level_range", 10, "ln variance", "derived: a factor of 22,000 to either side"};
  Rule level_halvings{"level_halvings", 40, "halvings", "derived: of that range, to 2e-11"};
  // Calibration
  Rule bootstraps{"bootstraps", 200, "refits", "derived: 2.5 % of them are the 5th value from each end"};
  Rule folds{"folds", 5, "1", "chosen: a fifth of the flights is held out at a time"};
  Rule push_quantile{"push_quantile", 0.95, "1", "chosen: the steady push that 19 of 20 hovers stay below"};
  Rule interval_tail{"interval_tail", 0.025, "1", "derived: an interval of 95 % leaves so much beyond each end"};
  Rule same_place{"same_place", 0.1, "m", "derived: a voxel: windows farther apart are another hover"};
  // Refusals
  Rule least_flights{"least_flights", 3, "flights", "derived: scatter between flights, and a flight held out"};
  Rule least_of_place{"least_of_place", 2, "flights", "derived: of one map, to tell flights from maps"};
  Rule least_hovers{"least_hovers", 6, "hovers", "derived: one more than the ground's five parameters"};
  Rule least_spread{"least_spread", 0.2, "m", "derived: two voxels, within which heights and wall distances are one"};
  // Assessment
  Rule height_step{"height_step", 0.25, "m", "chosen: of the bound by height alone, the rival of the model"};
  Rule highest{"highest", 100, "m", "derived: above all floors, where none is below"};
  // Variance by height
  Rule fewest_height_rows{"fewest_height_rows", 10, "windows", "chosen: the regression has 6 columns"};
  Rule low_height{"low_height", 0.01, "m", "derived: the lowest height of the recordings (docs/measurements/recordings.md)"};
  Rule high_height{"high_height", 0.8, "m", "derived: the highest height of the recordings"};
  Rule height_length{"height_length", 0.05, "m", "chosen: where half of the wash returns, two rotor radii of the recorded craft"};
  Rule height_draws{"height_draws", 500, "draws", "derived: 2.5 % of them are the 12th value from each end"};
  Rule height_ridge{"height_ridge", 1e-9, "1", "derived: keeps an inverse finite, changes no digit that is told"};
  // clang-format on
};
inline constexpr CalibrationRules kCalibrationRules;

}  // namespace backwash::study::calibrate
