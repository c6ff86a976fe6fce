// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string>
#include <tl/expected.hpp>

#include "core/types/model.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::config {

/// One line that names file, line, key, value and range or what would be right.
struct ConfigError {
  enum class Kind { not_found, invalid } kind;
  std::string message;
};

/// Reads a vehicle file; `builtin:quad-5in` and `builtin:quad-7in` name the two that ship. An unknown, missing or
/// out-of-range key is an error. `controller` takes either kp/kd or px4 = { MPC_XY_P, MPC_XY_VEL_P_ACC, MPC_Z_P,
/// MPC_Z_VEL_P_ACC } with k_p = P_pos·P_vel, k_d = P_vel (docs/model.md section 4). Optional keys: latency,
/// feedback_delay, attitude_lag, velocity_integrator (default 0; in px4 = { … } MPC_XY_VEL_I_ACC and MPC_Z_VEL_I_ACC);
/// the other px4 gains (PX4's defaults).
tl::expected<Vehicle, ConfigError> load_vehicle(const std::string& path);

/// Reads a model file; `builtin:quad-5in` and `builtin:quad-7in` ship. `[bound] mean` (default 0), `tau_w` and
/// `ground.r0` are optional; `[confidence]` and `[provenance]` are accepted and not read.
/// Of the study's `[[extension.term]]` the `effect` list is read ({ kind, value, error, scale }, ModelEffect; README.md
/// of core/study); the rest of a term is the study's own.
tl::expected<Model, ConfigError> load_model(const std::string& path);

/// The interval of τ_w that calibration wrote into a model file, s: `[confidence] "bound.tau_w"`, else `[bound] tau_w`
/// twice. Error: of load_model(); an interval that is not two rising times above 0.
tl::expected<std::array<double, 2>, ConfigError> load_tau_interval(const std::string& path);

}  // namespace backwash::config
