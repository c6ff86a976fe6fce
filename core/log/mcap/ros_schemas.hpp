// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

namespace backwash::log {

/// The definition of a ROS 2 message as a recording holds it (schema encoding ros2msg): its own members, then those of
/// every type that they need. `type` as nav_msgs/Odometry. Precondition: it is one of those that are written here
/// (core/log/mcap/ros_messages.hpp).
std::string ros_schema(std::string_view type);

}  // namespace backwash::log
