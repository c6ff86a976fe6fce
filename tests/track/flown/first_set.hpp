// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/types/vehicle.hpp"

namespace backwash::track {

/// A vehicle whose first set is 0.1 m and 0.5 m/s.
inline Vehicle first_set() {
  Vehicle v;
  v.initial_error = {0.1, 0.5};
  return v;
}

}  // namespace backwash::track
