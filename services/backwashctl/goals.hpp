// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <tl/expected.hpp>

#include "services/backwashctl/station.hpp"

namespace backwash::ctl {

/// What a goal of RViz and its like must be, and what is made of it.
struct GoalRules {
  std::string frame = "map";     ///< header.frame_id
  std::optional<double> height;  ///< z of every goal, m, map: a goal on the ground plane has none of its own
  bool facing = true;            ///< its heading is turned to at the goal
};

struct Goal {
  Vec3 p_W;                   ///< m, map
  std::optional<double> yaw;  ///< rad, of the body's x axis from the map's, counter-clockwise
};

/// The goal of a message, or why it is none, with what would be right. `now_ns`: the wall clock, against which its
/// stamp is judged: what a network held back is no wish any more. Stamp 0: not stamped. An orientation of zeros: no
/// heading.
tl::expected<Goal, std::string> goal_of(const dds::PoseStamped& message, const GoalRules& rules, std::int64_t now_ns);

/// Sends the goals of ROS 2 topic `topic` (geometry_msgs/PoseStamped, reliable) as gotos until interrupted, the newest
/// where several wait, and says what became of each: a line, with `json` an object. The session lasts from a goal to
/// its acknowledgement, so that other stations are heard between goals. Returns 0.
int serve_goals(Station& station, const std::string& topic, const GoalRules& rules, bool json);

}  // namespace backwash::ctl
