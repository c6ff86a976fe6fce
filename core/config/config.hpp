// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "core/types/model.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::config {

/// One line that names file, line, key, value and range or what would be right.
struct ConfigError {
  enum class Kind { not_found, invalid } kind;
  std::string message;
};

/// A number in place of that of a file: "body.mass", 1.02.
struct ChangedKey {
  std::string key;
  double value;
};

/// Reads a vehicle file (keys: docs/interfaces.md, "Vehicle file"); `builtin:quad-5in` and `builtin:quad-7in` name the
/// two that ship. An unknown, missing or out-of-range key is an error. Of px4 k_p = P_pos·P_vel, k_d = P_vel.
tl::expected<Vehicle, ConfigError> load_vehicle(const std::string& path);
/// As if the file had these numbers.
tl::expected<Vehicle, ConfigError> load_vehicle_with(const std::string& path, const std::vector<ChangedKey>& changed);

/// Reads a model file (keys: docs/interfaces.md, "Model file"); `builtin:quad-5in` and `builtin:quad-7in` ship. Of the
/// study's `[[extension.term]]` the `effect` list is read (ModelEffect); the rest of a term is the study's own.
tl::expected<Model, ConfigError> load_model(const std::string& path);

/// The interval of τ_w that calibration wrote into a model file, s: `[confidence] "bound.tau_w"`, else `[bound] tau_w`
/// twice. Error: of load_model(); an interval that is not two rising times above 0.
tl::expected<std::array<double, 2>, ConfigError> load_tau_interval(const std::string& path);

}  // namespace backwash::config
