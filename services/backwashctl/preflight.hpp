// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "services/backwashctl/station.hpp"

namespace backwash::ctl {

/// One line of `backwashctl check`.
struct Finding {
  std::string name;
  bool good = false;
  std::string found;
  std::string advice;  ///< what to do; empty when good
};

/// Preflight from two statuses `seconds` apart: frames, rates, ages, clock, map, and the autopilot's parameters as the
/// daemon judges them. One that the autopilot has not told is not good.
std::vector<Finding> preflight(const StatusCopy& before, const StatusCopy& after, double seconds);

}  // namespace backwash::ctl
