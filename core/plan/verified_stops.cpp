// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/verified_stops.hpp"

#include "core/plan/rest.hpp"
#include "core/plan/stop.hpp"

namespace backwash::plan {

std::vector<Stop> verified_stops(const World& world, const State& start, const Setpoint& previous,
                                 const std::vector<Setpoint>& commands, std::size_t from, std::size_t every,
                                 const std::function<double(const reach::ReachTube&)>& clearance) {
  std::size_t moving = commands.size();
  while (moving > 0 && commands[moving - 1].v_W.isZero()) --moving;
  std::vector<Stop> stops;
  const auto verify_stop = [&](std::size_t branch) {
    // stop_along() uses half of the limit it is given.
    auto stopped = stop_along(commands, branch, 2 * world.reach.vehicle.limits.a_max);
    hold_until_settled(world.reach, stopped);
    const auto tube = tube_to_rest(world, start, previous, stopped);
    if (!(clearance(tube) > 0)) return;
    const auto own = static_cast<std::ptrdiff_t>(branch);
    stops.push_back({branch, {stopped.begin() + own, stopped.end()}, {tube.begin() + own, tube.end()}});
  };
  for (std::size_t branch = from; branch < moving; branch += every) verify_stop(branch);
  // What is told to stop after the last of them comes to rest by itself, sooner than a stop would.
  if (!stops.empty() && stops.back().branch + every >= moving && moving < commands.size()) verify_stop(moving);
  return stops;
}

}  // namespace backwash::plan
