// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "core/plan/planner.hpp"
#include "core/plan/world/world.hpp"
#include "core/types/waypoint.hpp"

namespace backwash::study {

/// Waypoints to be flown to in turn, at rest at each, and again from the first one on.
struct Way {
  std::string name;
  std::vector<Waypoint> points;
  std::string why_not = {};  ///< where the map has no place for it at all; then there are no points
};

/// Manoeuvres at places of this map that hovering can be safe at and that a flight from `start_W` may reach: hovers at
/// heights and under ceilings, up and down, lines, turns of the heading by the path and on the spot, walls approached,
/// standing still. Some of them may not fit: that flown_way finds out.
std::vector<Way> ways(const plan::World& world, const Vec3& start_W);

/// A way as it would be flown.
struct FlownWay {
  std::vector<Waypoint> points;    ///< rows of a points file, at most as many as `backwashctl follow` takes
  std::vector<Setpoint> commands;  ///< 20 ms apart, from rest at the start
  std::string why_not = {};        ///< why it does not fit; then there are no points
};

/// Plans and verifies each leg, from `start_W` to the first point, and around until the flight is as long as
/// `flight_time`, s. Heading and rests are the daemon's: the path's heading, then a turn where the waypoint has a
/// heading, and a hold after each leg.
FlownWay flown_way(const plan::World& world, const Vec3& start_W, const Way& way, double flight_time);

}  // namespace backwash::study
