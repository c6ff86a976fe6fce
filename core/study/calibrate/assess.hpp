// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/study/calibrate/fit.hpp"

namespace backwash::study::calibrate {

/// Windows of a range of wall distance or height, and the share of them below the bound, per axis.
struct Bin {
  double low, high;  ///< m
  std::size_t windows;
  Vec3 coverage;
};

/// How a bound does on data: does it hold, and is it no looser than it must be?
struct Assessment {
  std::size_t windows;
  Vec3 coverage;                      ///< share of windows with variance ≤ bound, per axis
  std::vector<Vec3> flight_coverage;  ///< the same per flight; 0 windows: zero
  std::vector<std::size_t> flight_windows;
  std::vector<Bin> by_wall_distance, by_height;
  Vec3 bound_over_observed;  ///< median of Σ_aa/variance, per axis: sharpness
  double loss;               ///< mean pinball loss of ln variance
  double constant_loss;      ///< the same of the best constant bound per axis, chosen on these very data
  double height_loss;        ///< of the best bound by height alone (0.25 m steps), chosen likewise
};

/// `ln_bound`: ln Σ_aa per hover of `data`. Wall distances beyond 1.5 m and heights beyond 1.9 m share a bin.
Assessment assess(const Data& data, std::span<const Vec3> ln_bound, double quantile);

/// ln Σ_aa per hover for one set of parameters.
std::vector<Vec3> ln_bounds(const Data& data, const Parameters& parameters);

/// ln Σ_aa per hover from fits that did not see the hover's flight: `folds` groups of flights, spread evenly over the
/// places. Precondition: at least two flights per place.
std::vector<Vec3> held_out_ln_bounds(const Data& data, const Parameters& start, const FitOptions& options, int folds);

}  // namespace backwash::study::calibrate
