// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "core/log/octets.hpp"
#include "services/maps/frame_tree.hpp"

namespace backwash::maps {

/// Points in their sensor's frame, m.
struct CloudMessage {
  std::int64_t stamp_ns = 0;
  std::string frame;
  std::vector<Vec3> points;
  bool single = false;  ///< coordinates had 32 bits
};

/// Where a frame was in another. `child` is empty where the message names none, or the one that it is in.
struct PoseMessage {
  std::string parent, child;
  std::int64_t stamp_ns = 0;
  std::optional<Pose> pose;  ///< none: the message holds no place, or no rotation
};

/// Messages of ROS 2 in CDR, by their type. Nothing: another type; an error: what is wrong with this one. Whether it
/// ended early, `cdr.good` says.
/// sensor_msgs/PointCloud2 and livox_ros_driver's CustomMsg of both versions.
std::optional<tl::expected<CloudMessage, std::string>> read_cloud(const std::string& type, log::Octets& cdr);
/// tf2_msgs/TFMessage, nav_msgs/Odometry, geometry_msgs/PoseStamped, and px4_msgs/VehicleOdometry, which becomes the
/// body (x forward, y left, z up) in axes that point north, west and up.
std::optional<std::vector<PoseMessage>> read_poses(const std::string& type, log::Octets& cdr);

}  // namespace backwash::maps
