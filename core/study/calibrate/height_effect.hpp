// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/log/columns/flight_log.hpp"
#include "core/study/calibrate/calibrate.hpp"
#include "core/study/windows/hover_windows.hpp"

namespace backwash::study::calibrate {

enum class Plate { none, above, not_said };

/// A window of a flight over a floor, with or without a plate above.
struct HeightRow {
  std::size_t flight;
  int day;               ///< flights of one day share their level
  double ln_variance_z;  ///< of the vertical acceleration
  double ln_speed;       ///< of the root-mean-square speed, m/s
  double height;         ///< above where the vehicle stood, m, > 0
  Plate plate;
};

/// Rows of a flight's windows: recordings of `backwash import airgarage` (columns stood_z_m, ceiling, day). Windows
/// less than 5 mm above where it stood may touch the ground and are left out.
std::vector<HeightRow> height_rows(const FlightWindows& windows, const log::FlightLog& log, std::size_t flight);

/// Ratios of the vertical variance, day and speed held fixed.
struct HeightEffect {
  CalibratedValue low_over_high;           ///< at `low_m` against `high_m`, by the law below
  std::optional<CalibratedValue> bins;     ///< heights within a factor of two of `low_m` against those of `high_m`:
                                           ///< no law; none where no flight was that low or that high
  std::optional<CalibratedValue> ceiling;  ///< under the plate against without, at the same height; none where no
                                           ///< flight is known to be the one or the other
  double low_m, high_m;
  std::size_t windows, flights, days;
  std::size_t low_flights, high_flights;  ///< that were within a factor of two of these heights
  double within, between;                 ///< scatter of ln variance within and between the flights of a day, sd
};

/// Generalised least squares of ln v = level(day) + flight + β_s ln speed + β_h/(1 + (height/length)²) + β_c plate
/// [+ β_u not said], flights' levels random (σ_b²: variance components by moments, within days), days' fixed;
/// intervals by resampling flights, so that the windows of one flight count as one draw. `bins` has steps instead of
/// the law: within a factor of two of low_m, of high_m, and between them below and above √(low_m high_m); rows
/// higher than 2 high_m are left out of it. What the raw ratio would show is mostly the day. `length_m`: where the
/// wash's return has fallen to half. Precondition: at least 10 rows and two heights.
HeightEffect height_effect(const std::vector<HeightRow>& rows, double low_m, double high_m, double length_m,
                           int bootstraps, std::uint64_t seed);

/// 1 cm against 0.8 m, the wash's return halved at 5 cm (about two rotor radii of the small vehicles recorded so).
struct HeightEffects {
  HeightEffect all;                    ///< hovers and passes
  std::optional<HeightEffect> hovers;  ///< windows slower than 0.12 m/s: the variance of a pass holds its own
                                       ///< acceleration where no set-points say it
};
/// Nothing with fewer than 10 rows.
std::optional<HeightEffects> height_effects(const std::vector<HeightRow>& rows, std::uint64_t seed);

}  // namespace backwash::study::calibrate
