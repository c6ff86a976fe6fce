// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/plan/search/shortcuts.hpp"
#include "core/plan/search/way.hpp"

namespace backwash::plan {

struct ShortenedWay {
  Way::Status status;           ///< of the way over single voxels where blocks gave no motions
  std::vector<Motion> motions;  ///< join with equal position and velocity; the last ends at rest at the goal
  double cost;                  ///< ∫‖u‖² dt + rho·T, m²/s³
  std::size_t expanded;         ///< blocks
};

/// From a state to rest at a goal, bounded in time where a search over velocities is not: a way over blocks of two
/// voxels, else of single ones, flown with stops and shortened. Without motions although the status is found: the start
/// cannot stop within passable voxels. `rho`: of the cost, m²/s⁴. Precondition: start and goal lie in passable voxels.
ShortenedWay shortened_way(const SafeView& space, const State& start, const Vec3& goal_W, const AxisLimits& limits,
                           double rho, std::chrono::steady_clock::time_point deadline);

}  // namespace backwash::plan
