// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/plan/world/world.hpp"

namespace backwash::plan {

/// Holds the last command, at rest, until the loop has settled (reach::settling_periods). What rests already counts.
void hold_until_settled(const reach::Reachability& reach, std::vector<Setpoint>& commands);

/// reach::tube_over_field() of commands that end at rest, whose last entry holds for ever (method tight): it is the set
/// of that place of rest, so that the tube's clearance answers may_rest_at() too, for who arrives by it
/// (docs/model.md 5.2-8). Where that set has no bound in free space the entry touches.
reach::ReachTube tube_to_rest(const World& world, const State& start, const Setpoint& previous,
                              const std::vector<Setpoint>& commands);

}  // namespace backwash::plan
