// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/study/windows/gates/rule.hpp"

namespace backwash::study {

/// Every constant of a comparison of flights before and after a change (`backwash study --rules`). Members are rules
/// and nothing else.
struct BeforeAfterRules {
  // clang-format off
  Rule told_level{"told_level", 0.05, "1", "chosen: chance that anything at all is told of flights that differ in nothing, better or worse"};
  Rule told_power{"told_power", 0.8, "1", "chosen: four times in five, as the smallest effects of a study"};
  Rule worth{"worth", 0.1, "of what was before", "chosen: the change for which the number of flights is told"};
  Rule alike{"alike", 0.1, "of the least", "chosen: rates, periods of set-points and ways of flying that differ less are alike"};
  Rule fewest_windows{"fewest_windows", 3, "windows", "chosen: fewer say little of a flight"};
  Rule most_needed{"most_needed", 1000, "flights", "chosen: more are told as more"};
  Rule nearest_cell{"nearest_cell", 0.25, "m", "chosen: what is nearer is one place; beyond it an octave is one"};
  Rule farthest_cell{"farthest_cell", 2, "m", "chosen: farther, the air is as free as it gets"};
  Rule slowest_cell{"slowest_cell", 0.125, "m/s", "derived: still_speed: below it a craft hovers; beyond it an octave is one"};
  Rule lowest_vibration{"lowest_vibration", 5, "Hz", "chosen: slower is the loop's answer to gusts"};
  // clang-format on
};
inline constexpr BeforeAfterRules kBeforeAfterRules;

}  // namespace backwash::study
