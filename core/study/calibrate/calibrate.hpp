// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "core/study/calibrate/assess.hpp"
#include "core/study/windows/hover_windows.hpp"

namespace backwash::study::calibrate {

/// Constants that the flights cannot determine, why, and the flight that would.
struct Refusal {
  std::string what;  ///< table of the model file, as in "wall", or "all"
  std::vector<Parameter> parameters;
  std::string why, flight;
  bool of_everything() const { return parameters.size() == kParameters; }
};

/// What the geometry of the flights leaves undetermined, before anything is fitted: gates as in the base model. Empty
/// if every parameter can be had. The rules are in core/study/calibrate/README.md.
std::vector<Refusal> refusals(const Data& data, const Model& gates);

struct Interval {
  double low, high;
};

/// A number with its 95 % interval from the bootstrap by flight.
struct CalibratedValue {
  double value;
  Interval ci95;
};

struct Options {
  FitOptions fit;
  int bootstraps = static_cast<int>(kCalibrationRules.bootstraps);
  int folds = static_cast<int>(kCalibrationRules.folds);
  std::uint64_t seed = 1;
  std::function<void(std::size_t done, std::size_t of)> progress = [](std::size_t, std::size_t) {};  ///< of the refits
};

/// [bound] mean, m/s².
struct SteadyPush {
  CalibratedValue horizontal, vertical;
};

struct Calibration {
  Fit fitted;
  Model model;      ///< the gates' model with what was determined
  Free determined;  ///< parameters that the flights determine; the others are the gates' model's
  std::array<Interval, kParameters> ci95;
  std::optional<SteadyPush> push;  ///< none where the logs do not hold it (no set-points)
  CalibratedValue tau_w;           ///< s
  Assessment on_fitted;            ///< on the flights fitted
  Assessment held_out;             ///< every flight against a fit without it (`folds`)
};

/// Fits the model's bound at a quantile (fit.hpp), with intervals by resampling whole flights within each place
/// (percentiles of `bootstraps` refits, each started from the estimate, widened for few flights), held-out coverage,
/// steady push and correlation time. `undetermined` parameters are left at the gates' values. Deterministic for its
/// seed. 10 ms per bootstrap and thousand hovers.
Calibration calibrate(const Data& data, const Model& gates, std::span<const Refusal> undetermined, bool pushes,
                      const Options& options);

/// Hovers of one flight's windows in a map: windows of the same segment that follow each other, at their mean position.
/// Features of every hover: 16 field evaluations.
std::vector<Hover> hovers_of(const FlightWindows& flight, std::size_t number, const map::OccupancyGrid& grid,
                             const Model& gates);

}  // namespace backwash::study::calibrate
