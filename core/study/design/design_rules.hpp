// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/study/windows/gates/rule.hpp"

namespace backwash::study {

/// Every constant of the next flight's design (`backwash study --rules`). Members are rules and nothing else.
struct DesignRules {
  // clang-format off
  Rule design_flight_time{"design_flight_time", 90, "s", "derived: manoeuvre_windows windows, as the flights of the campaigns"};
  Rule design_most_rows{"design_most_rows", 64, "rows", "derived: what backwashctl follow takes"};
  Rule design_most_facing{"design_most_facing", 32, "rows", "derived: what it takes of places with headings"};
  Rule design_separated{"design_separated", 0.9, "1", "chosen: the probability with which the told number of flights separates"};
  Rule design_most_flights{"design_most_flights", 40, "flights", "chosen: more than three campaigns of 12; beyond, none is told"};
  Rule design_refit{"design_refit", 1e-6, "flights", "derived: what no flown window tells is fitted to the new ones, at no cost"};
  Rule design_plan_deadline{"design_plan_deadline", 1, "s", "measured: four times what 95 % of backwash compare's plans take, 247 ms (research/compare/README.md)"};
  Rule design_jitter{"design_jitter", 0.002, "m", "derived: so that no imagined window passes for a frozen or a standing one"};
  Rule design_nearer{"design_nearer", 1e-3, "m of room a m of way", "derived: the nearest of spots with the same room: 100 m of way are worth one voxel"};
  Rule design_small_side{"design_small_side", 0.3, "m", "chosen: a square whose sides turn the heading and little else; up and down about a height as well"};
  Rule design_large_side{"design_large_side", 0.8, "m", "chosen: as long as the way on which the heading turns by π/2"};
  Rule design_slow_step{"design_slow_step", 0.4, "m", "chosen: steps so short are flown at a third of the speed limit"};
  Rule design_wall_distance{"design_wall_distance", 0.35, "m", "derived: of wall_attraction's own manoeuvre"};
  // clang-format on
};
inline constexpr DesignRules kDesignRules;

}  // namespace backwash::study
