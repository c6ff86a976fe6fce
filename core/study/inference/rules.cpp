// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/rules.hpp"

#include <array>
#include <bit>

#include "core/study/windows/window_options.hpp"

namespace backwash::study {
namespace {

/// The thresholds of windows and gates, from the options' own defaults: the options are what calibrate and study run
/// by.
constexpr std::array<Rule, sizeof(WindowOptions) / sizeof(double)> window_rules() {
  constexpr WindowOptions kDefaults{};
  return {{
      {"window_length", kDefaults.length_s, "s",
       "chosen: a hover of 5 s holds two, and the band's slowest gusts half a cycle"},
      {"band_low", kDefaults.band.low_hz, "Hz", "chosen: slower, it is in the windows' means, which are fitted apart"},
      {"band_high", kDefaults.band.high_hz, "Hz",
       "derived: two fifths of 50 Hz, the rate of the control loop and of its logs"},
      {"tau_w", kDefaults.tau_w, "s", "measured: as bound.tau_w of the shipped model (docs/model.md section 3)"},
      {"settle", kDefaults.settle_s, "s", "chosen: at the start of each hover, counted as transit (calibration)"},
      {"gap", kDefaults.gap_s, "s", "derived: the period of 20 Hz, the least rate of a log: farther apart is a gap"},
      {"gap_periods", kDefaults.gap_periods, "median periods",
       "chosen: and farther apart than so many, so that jitter is none"},
      {"frozen", kDefaults.frozen_s, "s", "chosen: a position repeated so long, in 4 rows or more, has stopped"},
      {"perched_spread", kDefaults.perched_m, "m", "chosen: standard deviation of the position; hovers move by more"},
      {"perched_thrust", kDefaults.perched_thrust, "of the weight",
       "derived: below every hover, of a thrust curve that may be 30 % off"},
      {"idle", kDefaults.idle, "of the full command", "chosen: with all rotors below in some row the vehicle stands"},
      {"clear", kDefaults.clear_m, "m", "chosen: nearer to where it is known to have stood its feet may touch"},
      {"rotor_limit", kDefaults.limit, "of the full command", "chosen: a rotor so near to either end is at its limit"},
      {"saturated_share", kDefaults.saturated_share, "of a window's rows",
       "chosen: with a rotor at its limit; then the thrust is not what was asked for"},
      {"still_speed", kDefaults.still_mps, "m/s", "chosen: a hover is slower than this, averaged over still_time"},
      {"still_time", kDefaults.still_s, "s", "chosen: longer than a gust's push, shorter than a transit"},
      {"inconsistent", kDefaults.inconsistent_mps, "m/s",
       "chosen: between the way flown and the velocity's integral over a window"},
  }};
}

}  // namespace

std::vector<Rule> rules() {
  static_assert(sizeof(Rules) % sizeof(Rule) == 0, "a member that is no rule");
  static_assert(sizeof(WindowOptions) == 17 * sizeof(double), "a threshold of the windows that is not told above");
  const auto all = std::bit_cast<std::array<Rule, sizeof(Rules) / sizeof(Rule)>>(kRules);
  std::vector<Rule> told{all.begin(), all.end()};
  const auto of_windows = window_rules();
  told.insert(told.end(), of_windows.begin(), of_windows.end());
  return told;
}

}  // namespace backwash::study
