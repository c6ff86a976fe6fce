// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/map/occupancy_grid.hpp"
#include "tests/study_worlds/world.hpp"

namespace study_worlds {

using Rng = std::mt19937_64;

inline constexpr double kStep = 0.005;  ///< s, of the plan and of the integration

/// What the craft is told at a step.
struct Command {
  Vec3 p, v, a;
  double yaw;
  int segment;
};

/// A flight: dwells at places that the request's circumstances allow, and the ways between them, sampled at kStep.
std::vector<Command> draw_plan(const HiddenWorld& world, Rng& rng);

/// Flight `number` of the world along this plan. `charge`: of the battery at the start, 0 … 1; 0: as the world draws
/// it.
Table fly_along(const HiddenWorld& world, int number, const std::vector<Command>& plan, double charge = 0);
/// From when on the request's causes act in a flight, s; infinite where they do not.
double acts_since(const Request& request, int flight);

/// A room's voxels of 0.1 m, every cell known.
backwash::map::OccupancyGrid true_grid(const Room& room);

}  // namespace study_worlds
