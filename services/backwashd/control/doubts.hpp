// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "services/backwashd/control/controlled.hpp"

namespace backwash::daemon {

/// Names of `check` with what speaks against a flight there and what would be right.
using Doubts = std::vector<std::pair<const char*, std::string>>;

/// What the autopilot and its line say, beside its parameters and poses: the line's time and loss, its estimator, and
/// whether it would arm (dds::kArming, which the mode decides too).
Doubts doubts_of(const ControlView& view, const Vehicle& vehicle);

}  // namespace backwash::daemon
