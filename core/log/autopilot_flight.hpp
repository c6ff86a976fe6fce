// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "core/log/autopilot_clock.hpp"
#include "core/log/ros_messages.hpp"
#include "core/log/topic_log.hpp"

namespace backwash::log {

/// What an autopilot's own log says of its pose, in its local frame turned to z-up.
struct AutopilotPose {
  std::int64_t t_ns;  ///< CLOCK_MONOTONIC of the daemon
  ros::Moving moving;
};

/// Every vehicle_local_position of a log under PX4's names with the newest vehicle_attitude before it, on our clock.
/// Messages before the first attitude are left out. Error: the topic or column that is missing.
tl::expected<std::vector<AutopilotPose>, std::string> autopilot_poses(const TopicLog& topics, const ClockLine& clock);

}  // namespace backwash::log
