// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstddef>
#include <vector>

#include "core/plan/world/safe_space.hpp"

namespace backwash::plan {

/// A chain of points from one place to another, m, W; both ends included.
struct Way {
  /// none: blocks of this edge join nothing. given_up: the number of blocks or the deadline was reached.
  enum class Status { found, none, given_up } status;
  std::vector<Vec3> points;
  std::size_t expanded;  ///< blocks
};

/// A short way over cubes of `edge` voxels: A* over the 26 neighbours, from both ends in turn, until one of them has
/// found the other or has nowhere left to go. A step is taken where all voxels of the box about both cubes may be
/// passed. From and to the cubes of the ends steps are free when edge > 1, since these may be passed in part: what goes
/// there must be checked. With edge 1 a way is found exactly if voxels that share faces join the ends. Its length is at
/// most 1.5 times the shortest of its kind, 2.5 times with edge 1. Precondition: both ends are passable.
Way way_over_blocks(const SafeView& space, const Vec3& from_W, const Vec3& to_W, int edge, std::size_t most_expanded,
                    std::chrono::steady_clock::time_point deadline);

}  // namespace backwash::plan
