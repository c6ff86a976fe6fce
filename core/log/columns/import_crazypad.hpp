// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <tl/expected.hpp>

#include "core/log/columns/flight_log.hpp"

namespace backwash::log {

/// Reads one CrazyPAD table (100 Hz; columns t_s, position, velocity, ax_g … acceleration of the state estimate in g
/// with gravity removed, roll_deg, yaw_deg, motor1–4 of 0 … 65535, battery_mV) as a flight log: accelerations in m/s²,
/// motor commands 0 … 1, battery in V. There is no pitch, so no attitude (roll_deg and yaw_deg are not read and may
/// hold anything; some recordings have nan); no set-points and no collective thrust either. Errors: missing file or
/// column, a cell of another column that is no finite number.
tl::expected<FlightLog, LogError> import_crazypad(const std::string& path);

}  // namespace backwash::log
