// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/study/windows/band.hpp"

namespace backwash::study {

/// How a log becomes gated windows, for calibration and study alike.
struct WindowOptions {
  double length_s = 2;  ///< of a window
  Band band;            ///< of the variance
  double tau_w = 0.15;  ///< s, assumed when an attenuation is divided out (Model::bound.tau_w)
  double settle_s = 1;  ///< at the start of each hover, counted as transit (calibration)

  double gap_s = 0.05, gap_periods = 5;  ///< rows farther apart than both (median period) are a gap
  double frozen_s = 0.1;                 ///< a position repeated over so long, in 4 rows or more, has stopped
  double perched_m = 0.0003;             ///< largest standard deviation of the position of a vehicle that stands
  double perched_thrust = 0.6;    ///< of the weight: a mean over a window, of a thrust curve that may be 30 % off
  double idle = 0.05;             ///< of the full command: with all rotors below in some row it stands
  double clear_m = 0.005;         ///< above where a recording says that it stood: nearer, its feet may touch
  double limit = 0.01;            ///< of the full command: a rotor so near to either end is at its limit
  double saturated_share = 0.02;  ///< of a window's rows with a rotor at its limit
  double still_mps = 0.12, still_s = 0.5;  ///< a hover is slower than this, averaged over so long
  double inconsistent_mps = 0.15;          ///< between the way flown and the velocity's integral
};

}  // namespace backwash::study
