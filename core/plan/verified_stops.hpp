// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "core/plan/world/world.hpp"

namespace backwash::plan {

/// A way to rest that leaves a flight at its command `branch`, on the flight's own path, with its own verified tube.
struct Stop {
  std::size_t branch = 0;          ///< first command that is the stop's and not the flight's
  std::vector<Setpoint> commands;  ///< from there on: braking, then rest until the loop has settled
  reach::ReachTube tube;           ///< entries `branch` … end: one more than commands
};

/// Stops along `commands` from command `from` on, every `every` commands while the flight moves, ascending by branch:
/// stop_along() with the whole of a_max, swept from the same start as the flight itself. A stop whose `clearance` (m,
/// of the whole swept tube) is not above 0 is left out. Where the last of them is less than `every` commands before
/// rest, one more leaves at rest, for a STOP after it. About one propagation of the tube for each; not real-time.
std::vector<Stop> verified_stops(const World& world, const State& start, const Setpoint& previous,
                                 const std::vector<Setpoint>& commands, std::size_t from, std::size_t every,
                                 const std::function<double(const reach::ReachTube&)>& clearance);

}  // namespace backwash::plan
