// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/study/windows/gates/rule.hpp"

namespace backwash::study {

/// Every constant that decides what a log's windows are and what is measured on them (`backwash study --rules`).
/// Members are rules and nothing else: the printed list is the struct itself. What halving and doubling them does, and
/// where it was measured unless a reason says where: docs/measurements/window_rules.md.
struct WindowRules {
  // clang-format off
  // Windows and gates, for calibration and study alike
  Rule window_length{"window_length", 2, "s", "chosen: a hover of 5 s holds two, and the band's slowest gusts half a cycle"};
  Rule band_low{"band_low", 0.2, "Hz", "chosen: slower, it is in the windows' means, which are fitted apart"};
  Rule band_high{"band_high", 20, "Hz", "derived: two fifths of 50 Hz, the rate of the control loop and of its logs"};
  Rule tau_w{"tau_w", 0.15, "s", "measured: as bound.tau_w of the shipped model (docs/model.md section 3)"};
  Rule settle{"settle", 1, "s", "derived: two poles of the shipped gains (10, 5.5) leave e^-2.75, 6 %, of a step (calibration)"};
  Rule gap{"gap", 0.05, "s", "derived: the period of 20 Hz, the least rate of a log: farther apart is a gap"};
  Rule gap_periods{"gap_periods", 5, "median periods", "measured: halved and doubled, up to 5 of 33 windows change and no name"};
  Rule frozen{"frozen", 0.1, "s", "measured: halved and doubled no window of the recordings changes; five control periods"};
  Rule frozen_rows{"frozen_rows", 4, "rows", "measured: halved and doubled no window of the recordings changes; a tracker of half the log's rate repeats each position once"};
  Rule perched_spread{"perched_spread", 0.0003, "m", "measured: halved and doubled no window of the recordings changes; hovers move by 10 mm"};
  Rule perched_thrust{"perched_thrust", 0.6, "of the log's hover thrust", "derived: below every hover, of a thrust curve that may be 30 % off; no file's weight or thrust"};
  Rule idle{"idle", 0.05, "of the full command", "measured: halved and doubled no window of the recordings changes"};
  Rule clear{"clear", 0.005, "m", "measured: halved and doubled, 4 of 33 windows change and no name: nearer, feet may touch"};
  Rule rotor_limit{"rotor_limit", 0.01, "of the full command", "measured: halved and doubled, 1 of 69 windows changes; no rotor hovers near either end"};
  Rule saturated_share{"saturated_share", 0.02, "of a window's rows", "measured: halved and doubled, 4 of 69 windows change and no name; two rows at 50 Hz"};
  Rule still_speed{"still_speed", 0.12, "m/s", "measured: halved, half of the hovers are lost; doubled, transits among them are named as causes"};
  Rule still_time{"still_time", 0.5, "s", "measured: halved and doubled, up to 5 of 33 windows change and no name"};
  Rule still_enough{"still_enough", 0.8, "of still_time", "derived: rows at 10 Hz are 0.4 s apart at most within still_time"};
  Rule inconsistent{"inconsistent", 0.15, "m/s", "measured: halved, 2 windows of the recordings are lost; doubled, none changes"};
  Rule still_command{"still_command", 0.01, "m/s", "derived: a set-point that rests moves by rounding alone, 5 mm over still_time"};
  Rule rate_share{"rate_share", 0.4, "of the rate", "derived: as band_high at 50 Hz; half the rate would fold back"};
  Rule fewest_rows{"fewest_rows", 20, "rows", "derived: of a window at 10 Hz, below which nothing of a gust is seen"};
  Rule integral_step{"integral_step", 0.01, "ln of a frequency", "derived: an integral's relative error is below 1e-4"};
  // Gusts by their spectrum
  Rule tau_least{"tau_least", 0.01, "s", "derived: half a period of 50 Hz: shorter is white at a log's rate"};
  Rule tau_most{"tau_most", 2, "s", "derived: a window; longer, the band's lowest frequency sees no corner"};
  Rule noise_least{"noise_least", 1e-4, "of S(0)", "derived: 4 % of a first-order spectrum of tau_w at band_high"};
  Rule noise_most{"noise_most", 1, "of S(0)", "derived: more noise than gust at every frequency"};
  Rule tau_told{"tau_told", 0.002, "ln", "derived: a tenth of the interval that 24 flights give"};
  // Flights by sample
  Rule held{"held", 0.1, "s", "chosen: between rows farther apart a set-point is held and not interpolated; twice as far the closed loop starts anew"};
  Rule loop_step{"loop_step", 0.005, "s", "derived: a tenth of the shortest lag (0.05 s) that vehicles ship with"};
  Rule shift_step{"shift_step", 0.03, "s", "chosen: delays are about 0; designs are linear between 0, 1 and 2 steps"};
  Rule shift_far{"shift_far", 0.05, "s", "chosen: and on to 2, 3 and 4 of these, the longest that a loop survives"};
  Rule least_lag{"least_lag", 0.001, "s", "derived: a fifth of loop_step, below which a lag is none"};
  Rule more_lag{"more_lag", 0.03, "s", "chosen: the design of a longer lag is the loop's with so much more of it"};
  Rule loop_drag{"loop_drag", 0.2, "1/s", "derived: small enough that twice as much slows twice as much"};
  Rule command_age{"command_age", 0.25, "periods", "derived: a held command is half a period old on the mean, a streamed one not: the middle"};
  Rule slope_time{"slope_time", 0.06, "s", "measured: halved and doubled nothing told of the recordings changes; it loses 2 % of what moves at 2 Hz"};
  Rule slope_rows{"slope_rows", 1000, "rows", "derived: slope_time at 33 kHz, which no log has: a broken rate"};
  Rule stamp_error{"stamp_error", 1e-9, "s", "derived: rounding of a stamp, and no flight's rows are so near"};
  Rule row_error{"row_error", 1e-6, "rows", "derived: rounding of a stretch's length over its period"};
  Rule no_attitude{"no_attitude", 1e-6, "1", "derived: a quaternion that rounding made has no direction"};
  // Where a window was flown
  Rule stray{"stray", 0.3, "m", "measured: halved, forward_speed is 1.041 in place of 1.030; doubled, nothing changes"};
  Rule sunk{"sunk", 0.5, "of g", "derived: the heaviest payload that is possible lets a craft hover so much over k_p below its set-point"};
  Rule one_place{"one_place", 0.05, "m", "measured: halved and doubled no window, name or size of the recordings changes"};
  Rule offset_retreat{"offset_retreat", 0.25, "of an offset", "derived: 0.1 m of the farthest, a voxel: so far at a time back out of a solid"};
  Rule offset_limit{"offset_limit", 2, "ln variance", "derived: as ln_variance_limit; the map is then wrong by more"};
  Rule offsets_aside{"offsets_aside", 9, "1", "derived: offset_step apart, from -0.4 m to 0.4 m"};
  Rule offset_step{"offset_step", 0.1, "m", "derived: the voxel of the maps that are shipped"};
  Rule points_along{"points_along", 7, "1", "chosen: places along a window; at 1 m/s they are 0.3 m apart"};
  Rule sight{"sight", 3, "m", "derived: e^-5 is left of an effect of the longest length searched, 0.6 m"};
  Rule misplaced{"misplaced", 0.02, "of a flight's samples", "chosen: of 80 s, those of 1.6 s: a touch, or a landing beside the map; a wrong map takes more"};
  Rule sight_up{"sight_up", 20, "m", "derived: surfaces below and above, in rooms higher than any that was flown"};
  Rule room{"room", 1e5, "m", "derived: without a map, no flight is so far from its origin"};
  Rule sigma_lattice{"sigma_lattice", 0.15, "m", "chosen: Σ is evaluated so far apart and ln Σ interpolated"};
  Rule sigma_least{"sigma_least", 1e-9, "(m/s²)²", "derived: so that its logarithm is finite"};
  Rule corner_least{"corner_least", 1e-9, "1", "derived: a corner with so small a share changes no digit"};
  Rule whole_wall{"whole_wall", 1, "m", "chosen: how far a wall must reach where nothing is below or above"};
  // Means and variances
  Rule scatter2{"scatter2", 0.16, "(ln variance)²", "measured: halved and doubled no name or size of the recordings changes; anova measures the scatter that counts"};
  Rule mean_noise{"mean_noise", 0.002, "(m/s²)²", "measured: halved and doubled nothing told of the recordings changes; 0.045 m/s² of offset"};
  Rule mean_unit{"mean_unit", 0.01, "(m/s²)²", "derived: the unit of the weights, in which the scatter is estimated too"};
  Rule least_gusts{"least_gusts", 0.2, "of a window's variance", "measured: halved and doubled, sizes change by less than 0.1 %"};
  Rule fewest_spread{"fewest_spread", 4, "rows", "derived: two more than a variance and a correlation take"};
  Rule correlated{"correlated", 0.98, "1", "derived: at it a window of 100 rows is worth 2 samples, the least"};
  Rule noise_near{"noise_near", 0.3, "s", "measured: halved and doubled, a kurtosis of 1.09 becomes 1.07 and 1.32; two times tau_w"};
  Rule noise_between{"noise_between", 0.05, "s", "derived: a third of a gust's correlation time"};
  Rule noise_overlap{"noise_overlap", 5, "rows", "chosen: a lag that leaves fewer products is none"};
  Rule voltage_line{"voltage_line", 4, "windows", "chosen: of a flight, from which its course is a line; with fewer the mean, from twice as many a parabola"};
  // Thrust and command delays
  Rule excited_level{"excited_level", 0.05, "m/s²", "measured: halved and doubled, thrust_slope changes by at most 0.3 %"};
  Rule excited_rate{"excited_rate", 0.05, "m/s³", "measured: halved and doubled, sizes change by less than 0.1 %"};
  Rule slow_tilt{"slow_tilt", 0.45, "s", "measured: below 0.3 s the order of the attitude loop is told as a lag (tests/other_worlds, sluggish)"};
  Rule no_first_stage{"no_first_stage", 1e-6, "1", "derived: a determinant that rounding made"};
  Rule delay_turns{"delay_turns", 20, "turns", "derived: more than the fixed point of a delay below 0.2 s needs"};
  // Rotors
  Rule line_beside{"line_beside", 4, "1", "derived: neighbours on each side, 1 Hz apart: the mean of 8 exponential powers is known to 1/√8, a third"};
  Rule line_nearest{"line_nearest", 1.5, "Hz", "derived: what a line spreads over in line_block ends at 1 Hz"};
  Rule line_block{"line_block", 1, "s", "chosen: over more the phase that rpm readings give drifts"};
  Rule line_alike{"line_alike", 0.5, "1/line_block", "derived: lines so far apart share 0.4 of their noise"};
  Rule least_folded{"least_folded", 0.75, "Hz", "derived: below, a block of 1 s holds no whole turn, and the line is as slow as a gust"};
  Rule from_half_rate{"from_half_rate", 1, "Hz", "derived: nearer to half the rate a line's neighbours are missing"};
  Rule dropout{"dropout", 0.3, "of the median rpm", "derived: a rotor that slow would lift 9 %: it is the reading that is wrong"};
  Rule stuck_steps{"stuck_steps", 4, "steps of the log", "derived: rounding hides one of this rotor's and one of the others', noise as much again"};
  Rule least_motor{"least_motor", 1e-6, "of full thrust", "derived: so that its logarithm is finite"};
  Rule least_rpm{"least_rpm", 1, "rpm", "derived: so that its logarithm is finite"};
  // Flights that come twice
  Rule same_gusts{"same_gusts", 0.9, "1", "chosen: from this correlation of ln variances two flights are one"};
  Rule same_windows{"same_windows", 30, "values", "derived: 0.9 is then 7 standard errors (Fisher's z) from flights that share nothing"};
  Rule same_time{"same_time", 0.25, "of a window", "chosen: windows that share three quarters of their time are compared"};
  // clang-format on
};
inline constexpr WindowRules kWindowRules;

}  // namespace backwash::study
