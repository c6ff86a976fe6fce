// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "core/types/state.hpp"

namespace backwash::plan {

/// The same commands up to `branch`, then the same path slowed to rest: the pace s falls smoothly from 1 to 0, position
/// p(σ), heading yaw(σ), velocity s·v(σ), acceleration s²·a(σ) + ṡ·v(σ) at path time σ = ∫ s dt, so that every
/// commanded position lies on the verified path. The fall lasts as long as half of `a_max` (m/s², per axis) needs for
/// the fastest of what is ahead. Commands are 20 ms apart. Empty if the commands end before `branch`.
std::vector<Setpoint> stop_along(const std::vector<Setpoint>& commands, std::size_t branch, double a_max);

}  // namespace backwash::plan
