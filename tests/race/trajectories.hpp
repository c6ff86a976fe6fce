// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tests/race/course.hpp"

namespace backwash::race {

/// A trajectory that somebody else planned: commands every 20 ms, from rest to rest.
struct Trajectory {
  std::string by, map;  ///< planner and margin, or the kind of place
  double v_max;
  std::vector<Setpoint> commands;
};

/// Trajectories of other planners, of every file in `folder` as its README says.
std::vector<Trajectory> rivals(const std::string& folder);

/// A map of places that differ: an open hall with a pillar, its floor, a tunnel, a shaft, a corner behind the hall.
Place places();
/// Ways through them that a body of this radius flies 0.03 to 0.45 m from what is nearest, `count` a place.
std::vector<Trajectory> through_places(double radius, std::size_t count);

}  // namespace backwash::race
