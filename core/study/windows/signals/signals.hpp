// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <vector>

namespace backwash::study {

/// Removes the straight line that fits best.
std::vector<double> detrended(std::span<const double> x);

/// The parabola (fewer than 8 points: the line; fewer than 4: the mean) through x that fits best: a slow course without
/// what answers the moment.
std::vector<double> slow_course(std::span<const double> t, std::span<const double> x);

/// Variance of a detrended stretch, and how many independent samples it is worth: n (1 − ρ²)/(1 + ρ²) with ρ the
/// correlation of neighbours (a first-order process).
struct Spread {
  double variance, samples;
};
Spread spread(std::span<const double> detrended);

/// What spread() tells of n samples, `dt` s apart, of a first-order process of the variance 1 and the correlation time
/// `tau`, s: a line takes slow parts with it, and of a short stretch more.
double left_by_a_line(std::size_t n, double dt, double tau);

/// E[ln(χ²_n/n)] = ψ(n/2) − ln(n/2), and its variance ψ'(n/2): what the logarithm of a variance estimate of n samples
/// adds to the logarithm of the variance.
double ln_bias(double n);
double ln_variance(double n);

/// A rotor's line in a stretch.
struct RotorLine {
  /// ln of the power at the rotor's own phase over the mean power at phases detuned by ±1.5, ±2.5, ±3.5 and ±4.5 Hz,
  /// less its expectation for noise; twice the rotor's rate (two blades) is summed in, and blocks of 1 s, over which
  /// the phase from rpm readings does not drift. x is flattened first by a filter of first order.
  double excess = 0;
  /// At the rotor's rate alone: square of the amplitude beyond that noise (it may be negative by chance), and variance
  /// of white noise of the same power as the detuned phases. Units of x².
  double amplitude2 = 0, floor2 = 0;
  double folded = 0;  ///< where the rate lies after sampling, of the sampling rate, 0 … 1/2
};
/// Nothing where sampling folds the rotor's rate below least_folded or within from_half_rate of half the rate. `phase`:
/// rad at each sample, `t`: s.
std::optional<RotorLine> rotor_line(std::span<const double> x, std::span<const double> t,
                                    std::span<const double> phase);

}  // namespace backwash::study
