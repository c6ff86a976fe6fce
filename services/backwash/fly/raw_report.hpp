// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "core/types/vehicle.hpp"

namespace backwash::services {

/// `report` of an autopilot's own log: what flew, what its parameters and the flight say of its loop, vibration, and
/// which questions it can answer. As text or JSON on stdout, and a page where `out` names one. `vehicle`: empty, or
/// what the log is held against. Throws Failure.
int report_of_autopilots_log(const std::string& path, const std::string& vehicle, const std::string& out, bool json,
                             bool force);

}  // namespace backwash::services
