// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/rest.hpp"

#include <algorithm>
#include <cmath>

#include "core/reach/rest.hpp"

namespace backwash::plan {

void hold_until_settled(const reach::Reachability& reach, std::vector<Setpoint>& commands) {
  const Setpoint rest{commands.back().p_W, Vec3::Zero(), Vec3::Zero(), commands.back().yaw};
  const auto moves = [&](const Setpoint& c) { return c.p_W != rest.p_W || !c.v_W.isZero(0) || !c.a_W.isZero(0); };
  const auto resting = std::ranges::find_if(commands.rbegin(), commands.rend(), moves) - commands.rbegin();
  const auto wanted = static_cast<std::ptrdiff_t>(reach::settling_periods(reach));
  commands.insert(commands.end(), static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, wanted - resting)), rest);
}

reach::ReachTube tube_to_rest(const World& world, const State& start, const Setpoint& previous,
                              const std::vector<Setpoint>& commands) {
  auto tube = reach::tube_over_field(world.reach, start, previous, commands, world.bounds);
  const Vec3& p_W = commands.back().p_W;
  auto set = reach::hover_extent(world.reach, world.grid, world.distance, world.bounds, p_W, std::nullopt, &tube);
  reach::TubeStep& last = tube.back();
  if (!set.bounded) {
    const double touching = world.distance.exact(world.grid, last.center.p_W) + world.grid.resolution();
    for (std::size_t d = 0; d < kDirections; ++d) set.half_widths[d] = std::max(last.half_widths[d], touching);
  }
  // The entry stays about the predicted motion: what that is still off its end widens it.
  const Vec3 off = p_W + set.shift - last.center.p_W;
  for (std::size_t d = 0; d < kDirections; ++d)
    set.half_widths[d] += std::abs(unit(static_cast<Direction>(d)).dot(off));
  last.half_widths = last.half_widths_interval = set.half_widths;
  if (world.reach.method == reach::Method::tight)
    last.r_max = Vec3(set.half_widths[kX], set.half_widths[kY], set.half_widths[kZ]).norm();
  return tube;
}

}  // namespace backwash::plan
