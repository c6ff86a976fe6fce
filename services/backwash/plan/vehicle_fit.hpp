// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "services/backwash/verb.hpp"

namespace backwash::services {

/// `vehicle fit`: keys of a vehicle file, proposed from flight logs.
Verb vehicle_fit_verb(Command& group);

}  // namespace backwash::services
