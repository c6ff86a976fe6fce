// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/plan/planner.hpp"

namespace backwash::plan {

/// A trajectory that passed verification.
struct Refined {
  BSpline trajectory;
  std::vector<Setpoint> commands;  ///< every 20 ms, then the goal is held until the loop has settled
  reach::ReachTube tube;           ///< of these commands
  double clearance_m;              ///< of the swept tube
  reach::Risk risk{};              ///< where one was stated
};

struct Refinement {
  std::optional<Refined> found;
  std::string why;           ///< what the last trajectory that failed lacked; one line
  bool out_of_time = false;  ///< the deadline ended it
  double tubes_ms = 0, optimise_ms = 0, verify_ms = 0;
  std::size_t evaluations = 0;
};

/// Path of a search → spline → rounds of optimisation, re-timing and verification of the whole swept tube
/// (docs/model.md section 5b), at the searched pace and, if nothing passes, at slower ones. What fails is optimised
/// again about its own tube with a larger margin. The first that passes is returned, as fast as the limits let it be.
/// Deterministic but for the deadline. Precondition: the path starts at the command and ends at rest at the goal.
Refinement refine(const World& world, const std::vector<Motion>& path, const PlanStart& start, const Vec3& goal_W,
                  const PlanOptions& options, Clock::time_point deadline);

}  // namespace backwash::plan
