// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "services/backwash/verb.hpp"

namespace backwash::services {

/// `vehicle print`: a built-in file, to begin one's own with.
Verb vehicle_print_verb(Command& group);
/// `vehicle check`: whether a vehicle file is good, and what follows from it.
Verb vehicle_check_verb(Command& group);

}  // namespace backwash::services
