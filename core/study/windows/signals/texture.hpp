// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "core/types/geometry.hpp"

namespace backwash::study {

/// The detrended residual of a window, per axis, m/s², and the variance modelled there, (m/s²)².
struct Residual {
  std::array<std::vector<double>, 3> x;
  Vec3 sigma;
  bool comparable = true;  ///< else the vehicle's own manoeuvres are in it: measured, and not used
  std::vector<double> share =
      {};  ///< of each sample: Σ where it was flown over the window's; empty: the same all along
};

/// What a flight's residuals are made of, pooled over its windows (each over its modelled variance).
struct Texture {
  /// Variance per axis that neighbouring samples do not share, (m/s²)²: the accelerometer's noise, which adds to the
  /// gusts'. c₀ − c₁²/c₂ of the pooled autocovariance, what its geometric course from lags 1 and 2 leaves of lag 0; 0
  /// where that is negative (a filtered accelerometer, differentiated positions) or the course not falling.
  Vec3 white = Vec3::Zero();
  double scale = 1;                 ///< mean of measured (without white) over modelled variance
  std::vector<std::size_t> lags;    ///< samples, 0.3 to 1 s
  std::vector<double> correlation;  ///< at those lags, without white
};
Texture texture_of(const std::vector<Residual>& windows, double rate_hz);

/// A window's part of the kurtosis, both over the square of the flight's variance: a third of the mean of x⁴, and the
/// mean of x_i² x_j² at the texture's lags over 1 + 2ρ². Both are the same for a Gaussian signal, unbiased however
/// short the window is, as long as its variance goes as the modelled one along it and bursts 0.3 s apart are
/// independent. The white part is taken out of both.
struct Fourth {
  double at_once = 0, apart = 0;
};
Fourth fourth_moments(const Residual& window, const Texture& texture);

/// ln Σ at_once/Σ apart told as one number per window, of which the mean over all is that: its first order in each.
std::vector<double> tails(const std::vector<Fourth>& windows);

}  // namespace backwash::study
