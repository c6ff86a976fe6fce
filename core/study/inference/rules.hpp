// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/study/windows/gates/rule.hpp"
#include "core/types/normal.hpp"

namespace backwash::study {

/// Every constant that decides what a study says (`backwash study --rules`). Members are rules and nothing else: the
/// printed list is the struct itself. What single forms alone have is in the files of the effects.
struct Rules {
  // Search
  Rule sure_nats{"sure_nats", 6.9, "nats", "derived: odds of 1,000, told as surely"};
  Rule probable_nats{"probable_nats", 3, "nats", "derived: odds of 20, told as probably; less, perhaps"};
  Rule flips{"flips", 1200, "draws", "derived: resolves a sixth of a third of accept_p, a further structure's level"};
  Rule accept_p{"accept_p", 0.015, "1",
                "measured: at 0.03, 40 of 600 worlds without an effect raised alarms, at 0.015 5 of 249 "
                "(docs/measurements/confusion.md)"};
  Rule structure_share{"structure_share", 1.0 / 6, "of accept_p",
                       "chosen: structures gain much or little, and the catalogue's names shall lose little"};
  Rule dependence_share{"dependence_share", 1.0 / 6, "of accept_p", "chosen: as structure_share"};
  Rule further_level{"further_level", 1.0 / 3, "of accept_p",
                     "derived: Bonferroni over the 3 further names that most_causes leaves beside the first"};
  Rule most_causes{"most_causes", 4, "causes", "chosen: worlds with more than two were never tried"};
  Rule least_threshold{"least_threshold", 0.5, "nats", "derived: what one parameter without effect gains on average"};
  Rule harmonic_nats{"harmonic_nats", 1, "nats", "derived: what two parameters without effect gain on average"};
  Rule bound_error{"bound_error", 1e-6, "1", "derived: more than rounding in a bound that spares draws"};
  Rule structure_lead{"structure_lead", 3, "nats", "derived: a likelihood ratio of 20"};
  Rule structure_margin{"structure_margin", 0.6, "of the cause's gain",
                        "chosen: a structure has 4 columns and more and bends to where a form is wrong"};
  Rule least_share{
      "least_share", 0.08, "of an accepted gain",
      "chosen: the error of an accepted form gains less (docs/measurements/confusion.md, two causes, has the price)"};
  Rule left_share{"left_share", 1, "of an accepted gain",
                  "derived: the error of a form is smaller than what it explains"};
  Rule left_of_constant{"left_of_constant", 0.5, "of an accepted gain",
                        "chosen: a constant beside a structure half as strong is the structure's mean"};
  Rule structure_floor_mean{"structure_floor_mean", 0.03, "m/s²", "chosen: 1.5 floors of the pushes of the catalogue"};
  Rule structure_floor_ln{"structure_floor_ln", 0.2, "ln variance",
                          "chosen: 1.7 floors of the variances of the catalogue"};
  // Rivals
  Rule rival_nats{"rival_nats", 3, "nats", "derived: a likelihood ratio of 20"};
  Rule rival_errors{"rival_errors", 2, "standard errors", "derived: 95 % of the flights' difference"};
  Rule rival_most_nats{"rival_most_nats", 12, "nats", "chosen: four times rival_nats, however much flights differ"};
  Rule rival_rest{"rival_rest", 0.5, "of a gain", "chosen: what keeps more than half of its gain is a second cause"};
  Rule rival_share{"rival_share", 0.3, "of a gain",
                   "measured: of two columns that go together at 0.94 the wrong one has 0.70 to 0.77 of the gain"};
  Rule beyond_flown{"beyond_flown", 1.25, "1",
                    "chosen: a reference farther than a quarter outside of what was flown is an extrapolation"};
  // Scatter
  Rule motor_scatter{"motor_scatter", 0.01, "1",
                     "chosen: so well do reference flights tell a rotor's share (docs/measurements/recordings.md); "
                     "craft differ by built_scatter"};
  Rule dropout_scatter{"dropout_scatter", 0.003, "1", "chosen: of readings, lost by a sound sensor"};
  Rule least_scatter{"least_scatter", 1e-8, "channel²", "derived: so that an exact channel can be divided by"};
  Rule least_rotor_scatter{"least_rotor_scatter", 1e-6, "1",
                           "derived: so that counted dropouts without scatter can be divided by"};
  Rule ln_variance_limit{"ln_variance_limit", 2, "ln variance",
                         "chosen: no window weighs more than 7 times as much as its modelled variance says"};
  Rule fewest_trimmed{"fewest_trimmed", 3, "flights", "derived: two parameters and a scatter"};
  Rule no_turn{"no_turn", 1e-9, "1", "derived: a determinant that rounding made"};
  // Normal equations
  Rule most_columns{"most_columns", 16, "columns", "derived: eight cosines along both level axes"};
  Rule spanned{"spanned", 1e-4, "of a column's square", "chosen: what the nuisance explains up to 1 % has no say"};
  Rule least_square{"least_square", 1e-9, "1", "derived: a sum of squares that rounding made"};
  Rule left_out_share{"left_out_share", 0.02, "of a column's square",
                      "chosen: a column that one flight alone shows cannot be held out"};
  Rule ridge{"ridge", 1e-9, "1", "derived: keeps an inverse finite, changes no digit that is told"};
  // Estimates
  Rule tail{"tail", 0.025, "1", "derived: an interval of 95 % leaves so much beyond each end"};
  Rule normal_75{"normal_75", normal::k75, "1", "derived: its quantile, by which a median deviation is a standard one"};
  Rule normal_975{"normal_975", normal::k975, "1", "derived: its quantile of the normal distribution"};
  Rule fine_scales{"fine_scales", 12, "scales", "chosen: the likelihood is averaged over so many"};
  Rule beyond_scales{"beyond_scales", 1.5, "1", "chosen: the finer grid goes so far beyond the searched scales"};
  Rule rounds{"rounds", 2, "rounds",
              "chosen: of the likeliest shape and where it pushes the craft; of a fit and its scatter"};
  Rule turns{
      "turns", 4, "turns",
      "derived: each leaves the push's slope over k_p of the error: 0.15 at 0.3 m/s² over 0.2 m, 5e-4 after four"};
  Rule offset_difference{"offset_difference", 0.05, "m", "derived: half the spacing at which Σ is looked up"};
  Rule polish_evaluations{"polish_evaluations", 60, "evaluations", "chosen: of NLopt, in one or two dimensions"};
  Rule polish_divisor{"polish_divisor", 100, "1", "chosen: first step of NLopt over its tolerance"};
  Rule mixture_reach{"mixture_reach", 6, "standard errors", "derived: 1e-9 of a shape's estimate lies beyond"};
  Rule mixture_turns{"mixture_turns", 60, "halvings", "derived: more than a double's digits"};
  // What remains
  Rule shift_draws{"shift_draws", 1999, "draws", "derived: resolves a third of 0.05/30, which Holm asks of 30 pairs"};
  Rule enough_turns{"enough_turns", 50, "draws",
                    "derived: a p that so many draws tell is known to 1/√50, a seventh of itself"};
  Rule most_turns{"most_turns", 64, "turns a flight", "chosen: of 12 flights, 64^12 draws differ"};
  Rule median_of{"median_of", 400, "windows", "chosen: of which the kernel's width is the median distance"};
  Rule dependence_flights{"dependence_flights", 1000, "flights",
                          "chosen: evenly spread over those given; a thousand show a correlation of a few hundredths"};
  Rule most_features{"most_features", 100, "features", "chosen: rank of a kernel; 30 suffice for a smooth one"};
  Rule kernel_error{"kernel_error", 1e-5, "1", "chosen: of each entry of a kernel whose diagonal is 1"};
  Rule constant_regressor{"constant_regressor", 1e-3, "1", "chosen: sum of squares within flights"};
  Rule same{"same", 1e-12, "1", "derived: draws that turn no flight differ by rounding alone"};
  Rule dependence_level{"dependence_level", 0.05, "1", "chosen: family-wise, by Holm, beside an accepted cause"};
  // Rotors against sound flights
  Rule rotor_level{"rotor_level", 0.05, "1", "chosen: over the four rotors"};
  Rule rotor_of_interest{"rotor_of_interest", 0.06, "of one rotor's thrust",
                         "derived: the size of docs/measurements/confusion.md"};
  Rule fewest_sound{"fewest_sound", 4, "flights", "derived: three contrasts and a scatter"};
  // Causes in some flights only
  Rule fewest_divided{"fewest_divided", 6, "flights", "derived: two levels and a scatter about each"};
  Rule fewest_a_side{"fewest_a_side", 2, "flights", "derived: one flight alone has no scatter of its own"};
  Rule level_scatter{"level_scatter", 2, "degrees of freedom",
                     "measured: so many taken off, equally spread values pass no more often than normal ones"};
  Rule change_kinds{"change_kinds", 6, "1", "derived: as many as When has: each pays for all"};
  Rule change_share{"change_share", 1.0 / 3, "of accept_p",
                    "chosen: asked beside everything that all flights are asked"};
  Rule median_degrees{"median_degrees", 0.37, "of a value", "derived: the efficiency of a median deviation"};
  Rule moment_windows{"moment_windows", 5, "windows", "chosen: moments within each flight are asked every 10 s"};
  Rule most_parts{"most_parts", 3, "causes", "derived: as many further causes as most_causes leaves"};
  Rule side_windows{"side_windows", 4, "windows", "chosen: 8 s on either side of a step within a flight"};
  Rule sound_first{"sound_first", 1, "nats", "chosen: craft are sound before they are broken"};
  Rule sound_spread{"sound_spread", 0.03, "1", "chosen: farther off, a rotor is not as it was built"};
  // The extension
  Rule coverage_level{"coverage_level", 0.9, "of samples",
                      "derived: the interval is the central 90 %; more may be lost without harm"};
  Rule hovering{"hovering", 0.03, "m/s", "chosen: of the set-points' own motion; a lag of 0.1 s is 3 mm"};
  Rule least_shift{"least_shift", 0.002, "m",
                   "derived: a pose's error of 0.02 m (vehicle file) over the root of 100 windows"};
  Rule kept_shift{"kept_shift", 0.5, "of the predicted shift",
                  "derived: below it what was measured is nearer to no shift than to the predicted one"};
  Rule shift_interval{"shift_interval", 1, "of the predicted shift", "derived: wider, it holds both answers"};
  Rule fewest_shifted{"fewest_shifted", 3, "flights", "derived: one slope and a scatter"};
  Rule window_match{"window_match", 0.15, "s", "chosen: a window of 2 s moved by less holds 90 % of the same gusts"};
  // What is told of it
  Rule fewest_flights{"fewest_flights", 10, "flights",
                      "chosen: the campaigns have 12; with fewer no name is warranted"};
  Rule power{"power", 0.8, "1", "chosen: at which a minimum detectable effect is told"};
  Rule power_flips{"power_flips", 50, "draws", "derived: a power of 0.8 is known to √(0.8·0.2/50) = 0.06"};
  Rule power_halvings{"power_halvings", 14, "1", "derived: the size is known to e^(13.8/2^14), 0.1 %"};
  Rule power_low{"power_low", -9.2, "ln of a parameter", "derived: 1e-4 of its unit, below every floor"};
  Rule power_high{"power_high", 4.6, "ln of a parameter", "derived: 100 of its unit, above every cause"};
  Rule normal_95{"normal_95", normal::k95, "1", "derived: of the central 90 %, whose share of samples is told"};
  Rule least_variance{"least_variance", 1e-12, "(m/s²)²", "derived: so that a still window can be divided by"};
  Rule manoeuvre_windows{"manoeuvre_windows", 45, "windows", "derived: a flight of 90 s"};
  Rule manoeuvre_flights{"manoeuvre_flights", 12, "flights",
                         "derived: the flights of the campaigns (docs/measurements/confusion.md)"};
  Rule manoeuvre_nats{"manoeuvre_nats", 0.5, "nats", "derived: as least_threshold"};
  // What it changes for a flight
  Rule places{"places", 60, "windows", "chosen: of all that were flown, at which hover sets are computed"};
  Rule told_quantile{"told_quantile", 0.95, "1", "chosen: of the hover sets, told beside the median"};
  Rule plan_deadline{
      "plan_deadline", 3, "s",
      "measured: twelve times what 95 % of backwash compare's plans take, 247 ms (docs/measurements/compare.md)"};
  Rule least_route{"least_route", 0.3, "m", "chosen: between places that are nearer no plan is told"};
  Rule fewest_compared{"fewest_compared", 8, "windows", "chosen: in which a channel is simulated beside measured"};
  Rule picture_groups{"picture_groups", 12, "groups", "chosen: of windows, whose means a picture draws"};
  Rule most_odds{"most_odds", 1e6, "1", "chosen: larger odds are told as more than a million"};
};
inline constexpr Rules kRules;

/// All of them and those of the windows (WindowRules) and the effects (EffectRules), in the order of the structs.
std::vector<Rule> rules();

}  // namespace backwash::study
