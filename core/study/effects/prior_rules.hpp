// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <string>

#include "core/study/windows/gates/rule.hpp"

namespace backwash::study {

/// Typical sizes of what the catalogue's parameters are, by kind (`backwash study --rules`). Twice or half of one
/// changes what a size costs by 2 ln 2 = 1.4 nats at most. Members are rules and nothing else.
struct PriorRules {
  Rule typical_push{"typical_push", 0.5, "m/s²", "derived: air of 2 m/s against typical_rate, a tilt of 3 degrees"};
  Rule typical_rate{"typical_rate", 0.25, "1/s", "chosen: drag of rotors in a level flow, thrust lost in a climb"};
  Rule typical_share{"typical_share", 0.2, "1", "chosen: of the thrust: a battery beside the one that was weighed"};
  Rule typical_slope{"typical_slope", 0.5, "1", "derived: a curve half way between linear and square"};
  Rule typical_power{"typical_power", 2, "1", "derived: thrust goes with the square of the voltage"};
  Rule typical_delay{"typical_delay", 0.05, "s", "derived: a row of 20 ms, and a motor's time constant beside it"};
  Rule typical_ln{"typical_ln", 1, "ln variance", "derived: a factor e"};
  Rule typical_line{"typical_line", 3, "ln of a line's power", "derived: 13 dB over the noise, as structure_lead"};
};
inline constexpr PriorRules kPriors;

/// What is known of a parameter before any flight: how large it typically is (Form::prior_nats). However large, it is
/// unlikely and never refused. Ends are mathematics alone, or the sign that the law has by its definition: a fit beyond
/// them is another effect.
struct Prior {
  Rule typical;
  double least = -HUGE_VAL, most = HUGE_VAL;
  std::string reason = {};  ///< of the ends; empty without one
  bool holds(double value) const { return least <= value && value <= most; }
};

}  // namespace backwash::study
