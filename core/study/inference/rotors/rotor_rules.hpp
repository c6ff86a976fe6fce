// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/study/inference/rules.hpp"

namespace backwash::study {

/// Constants of what is told of single rotors; printed behind the others by rules().
struct RotorRules {
  Rule rotor_spread{"rotor_spread", 0.15, "1",
                    "measured: rotors of a sound craft differ by 5 to 15 % (docs/measurements/recordings.md)"};
  Rule spread_limit{"spread_limit", 2.5, "rotor_spread", "derived: the largest of four rotors passes it in 0.015"};
  Rule shaking_line{"shaking_line", 0.25, "ln power", "derived: as the floor of vibration"};
  Rule alike_windows{"alike_windows", 0.1, "of windows",
                     "chosen: two divisions of the flights that differ by less are one"};
  Rule unjudged_loss{"unjudged_loss", 1.5, "of the lost thrust",
                     "measured: rotors of 16 weak propellers of tests/other_worlds differ by 1.75 to 2.51 of it"};
  Rule balance_errors{"balance_errors", 2.6, "standard errors", "derived: a name is excluded at 0.01"};
};
inline constexpr RotorRules kRotorRules;

}  // namespace backwash::study
