// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/study/windows/gates/window_rules.hpp"
#include "core/study/windows/signals/band.hpp"

namespace backwash::study {

/// How a log becomes gated windows, for calibration and study alike. Why each is that: WindowRules.
struct WindowOptions {
  double length_s = kWindowRules.window_length;  ///< of a window
  Band band;                                     ///< of the variance
  double tau_w = kWindowRules.tau_w;             ///< s, assumed when an attenuation is divided out (Model::bound.tau_w)
  double settle_s = kWindowRules.settle;         ///< at the start of each hover, counted as transit (calibration)

  double gap_s = kWindowRules.gap, gap_periods = kWindowRules.gap_periods;  ///< rows farther apart than both are a gap
  double frozen_s = kWindowRules.frozen;  ///< a position repeated over so long, in frozen_rows or more, has stopped
  double perched_m = kWindowRules.perched_spread;  ///< largest standard deviation of the position of one that stands
  double perched_thrust = kWindowRules.perched_thrust;  ///< of the log's hover thrust, mean over a window
  double idle = kWindowRules.idle;          ///< of the full command: with all rotors below in some row it stands
  double clear_m = kWindowRules.clear;      ///< above where a recording says that it stood
  double limit = kWindowRules.rotor_limit;  ///< of the full command: a rotor so near to either end is at its limit
  double saturated_share = kWindowRules.saturated_share;  ///< of a window's rows with a rotor at its limit
  double still_mps = kWindowRules.still_speed,
         still_s = kWindowRules.still_time;             ///< a hover is slower, averaged over so long
  double inconsistent_mps = kWindowRules.inconsistent;  ///< between the way flown and the velocity's integral
};

}  // namespace backwash::study
