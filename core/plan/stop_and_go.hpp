// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/plan/safe_space.hpp"

namespace backwash::plan {

/// Brakes to rest, then flies straight lines from rest to rest along the chain of passable voxels to the goal, each as
/// long as its swept set is clear, within v_max and a_max per axis. Found whenever voxels that share faces join the
/// place of rest with the goal: the last resort where a search over motions gives up. Empty if that place cannot be
/// reached, or nothing joins it. O(voxels).
std::vector<Motion> stop_and_go(const SafeView& space, const State& start, const Vec3& goal_W, double v_max,
                                double a_max);

}  // namespace backwash::plan
