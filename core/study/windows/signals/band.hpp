// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "core/loop/position_loop.hpp"
#include "core/study/windows/gates/window_rules.hpp"

namespace backwash::study {

/// Frequencies that a variance counts, Hz (docs/model.md section 3).
struct Band {
  double low_hz = kWindowRules.band_low, high_hz = kWindowRules.band_high;
  /// The band that a signal of this rate can carry: the top is lowered to rate_share of the rate, below the Nyquist
  /// frequency.
  Band within(double rate_hz) const noexcept;
};

/// Zero-phase band-pass of an evenly sampled signal: second-order Butterworth high- and low-pass, each forwards and
/// backwards, −3 dB at the band's ends; both ends of the signal are continued by its mirror image (point
/// reflection would add a step of the mean). Below the Nyquist
/// frequency nothing folds back: the low-pass runs at the signal's own rate and nothing is thinned out. O(n).
/// Precondition: rate_hz > 2·high_hz, n ≥ 2.
std::vector<double> band_passed(std::span<const double> signal, double rate_hz, const Band& band);

/// var(a)/var(w) of a loop along an axis, for a disturbance w of correlation time tau_w (s; spectrum 1/(1 + (2πfτ)²)):
/// ∫|H|²S / ∫S (docs/model.md section 3; 0.64 at τ = 0.2 s and 0.39 at 0.5 s for gains (6, 4)). Both integrals
/// run over the band. Numerical, relative error below 1e-4.
double loop_attenuation(const loop::PositionLoop& loop, int axis, double tau_w, const Band& band);

}  // namespace backwash::study
