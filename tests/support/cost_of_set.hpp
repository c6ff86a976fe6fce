// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <vector>

#include "core/reach/clearance.hpp"
#include "core/reach/response/integrator.hpp"
#include "research/feasibility/set_cost.hpp"

namespace backwash::test {

/// plan::cost_of_set by its definition: both clearances of every voxel, looked for.
inline plan::SetCost cost_of_set(const plan::World& world) {
  const auto& vehicle = world.reach.vehicle;
  const double taken = vehicle.body.radius + vehicle.estimation.position;
  const reach::NetDisturbance net(world.reach, world.bounds);
  plan::SetCost cost;
  std::vector<double> given_up;
  for (std::size_t n = 0; n < world.grid.cell_count(); ++n) {
    if (world.grid.at(n) != map::Cell::free || world.distance.at(world.grid.voxel(n)) <= taken) continue;
    const Vec3 p_W = world.grid.center(world.grid.voxel(n));
    PerDirection h = net(world.bounds.at(world.grid.voxel(n))).w;
    for (std::size_t d = 0; d < kDirections; ++d)
      h[d] *= d == kZ ? world.reach.vertical.h_inf : world.reach.horizontal.h_inf;
    const double at_centre = reach::prism_distance(world.grid, p_W, h, 1 + taken) - taken;
    if (!(at_centre > 0)) continue;
    ++cost.safe_at_centre;
    const auto over_set = reach::hover_set(world.reach, world.grid, world.distance, world.bounds, p_W);
    if (!over_set.safe()) {
      ++cost.lost;
    } else if (at_centre < 1) {
      given_up.push_back(at_centre - over_set.clearance);
    }
  }
  if (given_up.empty()) return cost;
  std::ranges::sort(given_up);
  cost.median_m = given_up[given_up.size() / 2];
  cost.quantile95_m = given_up[given_up.size() * 95 / 100];
  return cost;
}

}  // namespace backwash::test
