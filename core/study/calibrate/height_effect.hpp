// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "core/study/calibrate/calibrate.hpp"

namespace backwash::study::calibrate {

/// A window of a flight over a floor, with or without a plate above.
struct HeightRow {
  std::size_t flight;
  int day;               ///< flights of one day share their level
  double ln_variance_z;  ///< of the vertical acceleration
  double ln_speed;       ///< of the root-mean-square speed, m/s
  double height;         ///< above the surface the vehicle starts from, m, > 0
  bool ceiling;          ///< flown under a plate
};

/// Ratios of the vertical variance, day and speed held fixed.
struct HeightEffect {
  Estimate low_over_high;  ///< at `low_m` against `high_m`
  Estimate ceiling;        ///< under the plate against without, at the same height; value 0 if there was no plate
  double low_m, high_m;
  std::size_t windows, flights, days;
};

/// Least squares of ln v = level(day) + β_s ln speed + β_h ln(height) + β_c ceiling, intervals by resampling flights.
/// What the raw ratio would show is mostly the day. Precondition: at least 10 rows and two heights.
HeightEffect height_effect(const std::vector<HeightRow>& rows, double low_m, double high_m, int bootstraps,
                           std::uint64_t seed);

}  // namespace backwash::study::calibrate
