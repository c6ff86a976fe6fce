// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <functional>
#include <span>
#include <vector>

#include "core/study/windows/signals/band.hpp"

namespace backwash::study {

/// Spectra that gusts are told by, all with the same correlation time τ = ∫₀ ρ dt (docs/model.md section 3).
enum class GustShape {
  karman,       ///< von Kármán, longitudinal: S ∝ (1 + (2πfT)²)^(−5/6)
  first_order,  ///< Dryden, longitudinal, and the law of the sets: S ∝ (1 + (2πfT)²)^(−1), ρ = e^(−t/τ)
  second_order  ///< critically damped: S ∝ (1 + (2πfT)²)^(−2)
};
inline constexpr auto kGustShapes = static_cast<std::size_t>(GustShape::second_order) + 1;

/// The likeliest spectrum of one shape.
struct GustFit {
  double tau_s = 0;          ///< correlation time, s
  double ln_likelihood = 0;  ///< Whittle's, up to what the shapes share
};
using GustFits = std::array<GustFit, kGustShapes>;  ///< by GustShape

/// Fits each shape to one stretch of the disturbance by Whittle's likelihood (1953) within the band:
///
///   minimise Σ_axes Σ_f ln S(f) + I(f)/S(f),   S(f) = |H(f)|² A_axis ((1 + (2πfT)²)^(−p) + r)
///
/// with τ/T = √π Γ(p)/Γ(p − ½) (docs/model.md 3-3b) and I the periodogram under a Hann taper. A per axis; τ and r, the
/// share of white noise, are common. What the band leaves out, and noise of the accelerometer, thus do not shorten τ.
/// `axes`: signals of equal length, evenly sampled at rate_hz. `passes(axis, f)`: |H|², what of a gust the signal
/// holds. τ is sought in 0.01 … 2 s. O(samples · frequencies). A stretch that holds none of the band's frequencies, or
/// no axis that moves, counts as white: half a sample.
GustFits gust_fits(std::span<const std::vector<double>> axes, double rate_hz, const Band& band,
                   const std::function<double(std::size_t axis, double f_hz)>& passes);

}  // namespace backwash::study
