// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>

#include "services/backwashctl/station.hpp"

namespace backwash::ctl {

/// The status as `status --json` prints it: the IDL's fields, with units in the names where they are not SI.
nlohmann::json json_of(const StatusCopy& status);
/// One line of it on stdout.
void print(const StatusCopy& status);

}  // namespace backwash::ctl
