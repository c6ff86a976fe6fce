// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "core/study/calibrate/calibrate.hpp"

namespace backwash::study::calibrate {

/// Where a calibration came from.
struct Provenance {
  std::string version, vehicle, base_model;
  std::vector<std::string> maps, logs;
  std::string signal;  ///< what stood for the disturbance
  std::size_t windows = 0;
  std::array<std::size_t, kHoverGates> gated{};
  std::uint64_t seed = 0;
  int bootstraps = 0;
  double quantile = 0;
};

/// The model file (docs/interfaces.md) with [confidence] (95 % intervals by dotted key, coverage, sharpness) and
/// [provenance]; config::load_model reads it. Constants that were not determined stand there too, named under
/// provenance.kept_from_base, and have no interval.
std::string model_text(const Calibration& calibration, const Provenance& provenance);

/// The tables of a model file that hold the model itself, [base] to [bound].
std::string model_tables(const Model& model);

}  // namespace backwash::study::calibrate
