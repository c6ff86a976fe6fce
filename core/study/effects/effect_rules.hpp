// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/study/windows/gates/rule.hpp"

namespace backwash::study {

/// Every constant that effects share and that decides what they explain (`backwash study --rules`). Members are rules
/// and nothing else. What a single form alone has (floor, least, priors, scales, reference) is in its file, under
/// these names.
struct EffectRules {
  // clang-format off
  // Surfaces and the place of a window
  Rule strayed{"strayed", 0.1, "m", "chosen: a push that moves the craft farther is not believed"};
  Rule place_turns{"place_turns", 4, "turns", "derived: as turns: the same fixed point, of the same slope"};
  Rule no_wall_nearer{"no_wall_nearer", 9, "m", "derived: beyond sight: where there is no surface, a rank needs one"};
  Rule under_ceiling{"under_ceiling", 1.5, "m", "derived: e^-2 of the longest length searched, 0.6 m, is left there"};
  Rule farthest_wash{"farthest_wash", 0.6, "m", "measured: of 30 washes of tests/other_worlds the longest is 0.42 m, cords are beyond 0.7 m"};
  Rule noise_unit{"noise_unit", 0.005, "(m/s²)²", "derived: the unit of a free noise; its size is fitted"};
  Rule offset_near{"offset_near", 0.15, "m", "derived: the spacing at which Σ is looked up; offsets are polished, from here and from twice it"};
  Rule offset_directions{"offset_directions", 8, "1", "chosen: 45 degrees apart; the direction is polished"};
  // Batteries and lines
  Rule no_sag{"no_sag", 1e-6, "1", "derived: so that it can be divided by"};
  Rule line_share{"line_share", 0.1, "of the windows of all rotors", "chosen: fewer lines are too few to speak for the flights"};
  // What stays free
  Rule drawn_windows{"drawn_windows", 32, "windows", "derived: more than the columns of any form and what stays free"};
  Rule left_of_free{"left_of_free", 1e-6, "of a column's square", "derived: more than rounding leaves"};
  // Structures
  Rule few_cosines{"few_cosines", 4, "cosines", "chosen: of a rank, for what varies slowly; twice as many for what varies faster: more cost draws"};
  Rule angle_turns{"angle_turns", 6, "turns", "chosen: of an angle; four rotors and four walls make 4"};
  Rule tone_highest{"tone_highest", 0.25, "Hz", "derived: half of one over a window"};
  Rule tone_lowest{"tone_lowest", 1.5, "periods", "derived: in the longest flight: slower ones are cosines of the time"};
  Rule tone_step{"tone_step", 0.5, "of one over the longest flight", "derived: a tone between two of them keeps 0.9 of its amplitude"};
  Rule most_tones{"most_tones", 400, "tones", "chosen: of a long flight the lowest; a flight of 13 minutes has all"};
  // clang-format on
};
inline constexpr EffectRules kEffectRules;

}  // namespace backwash::study
