// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "core/plan/planner.hpp"

namespace backwash::plan {

/// What flies: commands every 20 ms that end at rest, and the tube propagated once from the state where they began.
struct Route {
  State start;        ///< estimated when the commands began
  Setpoint previous;  ///< command active before the first
  std::vector<Setpoint> commands;
  reach::ReachTube tube;  ///< one entry more than commands
};

struct ReplanOptions {
  PlanOptions limits;
  double horizon_m = 7;  ///< how far along the way the local goal may lie
  double reserve_m = 0;  ///< clearance asked of a new path, and of hovering at its end, beyond limits.least_clearance_m
};

struct Replan {
  /// extended: a new path from the branch on. kept: the route that flies is still clear. stopping: it is not, but its
  /// stop on the path from the branch on is. unsafe: nothing was found clear; `route` is what comes closest to it.
  enum class Kind { extended, kept, stopping, unsafe } kind;
  Route route;          ///< to fly from now on; shares its commands before the branch with the one that flew
  double clearance_m;   ///< of its swept tube from `now` on
  bool reaches_goal;    ///< whether it ends at the goal
  std::string message;  ///< why it was not extended; one line
  PlanMetrics metrics;  ///< of the plan made, if one was
};

/// Voxels over shared faces from `from` to `goal`, both included, through what is hover-safe or may turn out to be: not
/// yet safe only because unknown voxels are nearer than any obstacle. Shortest; empty if the map already excludes every
/// way. Breadth first over the grid: O(voxels), some ten milliseconds.
std::vector<Index3> optimistic_way(const World& world, const Vec3& from_W, const Vec3& goal_W);

/// One step of flight with a receding horizon through a map that grows or changes (the paper's future work). `now`: the
/// next command to be given; `branch` ≥ now: the first command that may change. The goal may lie in unknown space. The
/// local goal is the farthest hover-safe voxel on the optimistic way within the horizon; the plan to it starts with the
/// position, velocity and acceleration commanded at the branch, and the heading goes on at its rate. The tube of the
/// whole is propagated in `world` from the route's own start: what the flight is judged with stays one tube. Every
/// result ends at rest inside its tube, so a verified stop is always at hand. After its last
/// command a route holds. Precondition: the route has a command.
Replan replan(const World& world, const Route& flying, std::size_t now, std::size_t branch, const Vec3& goal_W,
              const ReplanOptions& options);

}  // namespace backwash::plan
