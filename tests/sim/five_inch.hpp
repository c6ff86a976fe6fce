// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/config/config.hpp"

namespace backwash::sim {

inline Vehicle five_inch() { return config::load_vehicle("builtin:quad-5in").value(); }

}  // namespace backwash::sim
