// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/study/inference/rules.hpp"

namespace backwash::study {

/// Constants of what is told of single rotors; printed behind the others by rules().
struct RotorRules {
  Rule built_scatter{"built_scatter", 0.15, "ln",
                     "measured: rotors of a sound craft differ by 5 to 15 % (docs/measurements/recordings.md)"};
  Rule session_twist{"session_twist", 0.05, "ln",
                     "measured: the twist scatters by 0.026 and 0.069 between flights of two sound craft"};
  Rule session_pairs{"session_pairs", 0.045, "ln", "measured: the same of facing pairs, 0.043"};
  Rule session_degrees{"session_degrees", 2, "degrees of freedom", "derived: the two craft of which it is measured"};
  Rule torque_spread{"torque_spread", 0.5, "of the lost thrust",
                     "chosen: so much may the torque of a damaged propeller differ as well"};
  Rule alike_windows{"alike_windows", 0.1, "of windows",
                     "chosen: two divisions of the flights that differ by less are one"};
  Rule line_scatter{"line_scatter", 0.25, "ln power",
                    "chosen: by which lines of sound rotors differ; the floor of vibration"};
  Rule rotor_draws{"rotor_draws", 400, "draws", "derived: rotor_level is known to 0.011, a power of 0.8 to 0.02"};
  Rule need_turns{"need_turns", 8, "turns",
                  "derived: of halvings, after which largest_need is known to 0.006; of weights half would do"};
  Rule largest_need{"largest_need", 1.6, "ln", "derived: a propeller that gives a fifth"};
};
inline constexpr RotorRules kRotorRules;

}  // namespace backwash::study
