// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "core/log/autopilot/autopilot_clock.hpp"
#include "core/log/mcap/ros_messages.hpp"
#include "core/log/mcap/topic_log.hpp"
#include "core/log/raw/raw_log.hpp"

namespace backwash::log {

/// What an autopilot's own log says of its pose, in its local frame turned to z-up.
struct AutopilotPose {
  std::int64_t t_ns;  ///< CLOCK_MONOTONIC of the daemon
  ros::Moving moving;
};

/// Every vehicle_local_position of a log under PX4's names with the newest vehicle_attitude before it, on our clock.
/// Messages before the first attitude are left out. Error: the topic or column that is missing.
tl::expected<std::vector<AutopilotPose>, std::string> autopilot_poses(const TopicLog& topics, const ClockLine& clock);

/// How far the poses of an autopilot's log are from those that it told us over the link at the same times: the median,
/// m; none where no time has both. Of one flight that is what the link's delay makes of its speed. Where the vehicle
/// went more than 1 m away from where it was first, of those times alone. `poses`: rising in time.
std::optional<double> distance_from_link(const RawLog& log, std::span<const AutopilotPose> poses);

}  // namespace backwash::log
