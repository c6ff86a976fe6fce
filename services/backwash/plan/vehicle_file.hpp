// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/types/vehicle.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {

/// The thrust command u of the hover: f u² + (1 − f) u = share of the full thrust.
double hover_command(const Vehicle& v);

/// `vehicle print`: a built-in file, to begin one's own with.
Verb vehicle_print_verb(Command& group);
/// `vehicle check`: whether a vehicle file is good, and what follows from it.
Verb vehicle_check_verb(Command& group);

}  // namespace backwash::services
