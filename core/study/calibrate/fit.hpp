// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <bitset>
#include <span>
#include <vector>

#include "core/study/calibrate/features.hpp"
#include "core/types/geometry.hpp"

namespace backwash::study::calibrate {

/// The windows of one hover: where (as features) and what was measured.
struct Hover {
  std::size_t flight;  ///< number of the flight, from 0
  Vec3 p_W;            ///< mean position, m
  Features features;
  std::vector<Vec3> ln_variance;   ///< per window: of the disturbance along the world axes, ln (m/s²)²
  Vec3 push = Vec3::Zero();        ///< mean disturbance over the hover, m/s²
  Vec3 push_noise = Vec3::Zero();  ///< variance of that mean as an estimate of the steady push, (m/s²)²
  double tau_w = 0;                ///< correlation time, s
};

/// Hovers of several flights.
struct Data {
  std::vector<Hover> hovers;
  std::vector<std::size_t> place;  ///< per flight: which map it was flown in, from 0
};

/// Axes whose bounds share a scale: x and y together, z.
enum Group : std::size_t { kHorizontal, kVertical, kGroups };
inline Group group(int axis) noexcept { return axis == 2 ? kVertical : kHorizontal; }

/// A fitted bound: windows' variances lie below Σ(p) with probability q, over flights and windows alike.
struct Fit {
  Parameters parameters;
  double loss;  ///< mean pinball loss of ln variance on the data fitted, flights' levels included
  std::array<double, kGroups> between_sd, within_sd;  ///< scatter of ln variance between and within flights
};

/// Which parameters are free; the others keep the value of the start.
using Free = std::bitset<kParameters>;

struct FitOptions {
  double quantile = kCalibrationRules.quantile;
  Free free = Free().set();
  int rounds = static_cast<int>(kCalibrationRules.fit_rounds);  ///< of flight levels and bound in turn
};

/// Quantile regression of ln variance on ln Σ(p; θ) (docs/model.md section 2), θ ≥ 0:
///
///   minimise Σ_windows Σ_axes ρ_q(ln v − b_flight − ln Σ_aa(p; θ)),  ρ_q(r) = r (q − [r < 0])
///
/// b_flight: a random intercept per flight and Group, the mean residual of the flight shrunk by its analysis of
/// variance (σ_b² = var of flight means − what windows alone explain), so that a noisy day does not become a wall. ρ_q
/// is smoothed over 0.05 in ln v, the minimum sought with NLopt (L-BFGS within bounds, analytic gradient). At the end
/// all amplitudes of a group are scaled together, so that the share below Σ of N(0, σ_b²) + the residuals about their
/// flight's level is exactly q: the bound holds for a flight that was not fitted.
///
/// `flight_weights`: how often each flight counts (a bootstrap's draw). Deterministic. About 1 µs per window
/// and evaluation, a few hundred evaluations.
Fit fit(const Data& data, std::span<const double> flight_weights, const Parameters& start, const FitOptions& options);

/// Σ_aa(p; θ) per axis, (m/s²)².
Vec3 bound_variance(const Features& features, const Parameters& parameters) noexcept;

/// ρ_q(r) = r (q − [r < 0]).
inline double pinball(double r, double q) noexcept { return r < 0 ? (q - 1) * r : q * r; }

}  // namespace backwash::study::calibrate
