// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "core/types/odometry_timing.hpp"

namespace backwash::config {

/// In which frame the linear velocity of a nav_msgs/Odometry is.
enum class Twist : std::uint8_t {
  body,   ///< the child frame, as the message's definition says
  world,  ///< the frame of the pose
  none,   ///< it is not filled: the velocity comes from the poses
};
/// "body", "world" or "none".
std::string_view name(Twist twist) noexcept;

/// Type of the messages that the poses come in.
enum class PoseMessage : std::uint8_t {
  odometry,              ///< nav_msgs/Odometry
  pose,                  ///< geometry_msgs/PoseStamped, as motion capture sends it
  pose_with_covariance,  ///< geometry_msgs/PoseWithCovarianceStamped
  tf,                    ///< tf2_msgs/TFMessage
};
constexpr PoseMessage kPoseMessages[] = {PoseMessage::odometry, PoseMessage::pose, PoseMessage::pose_with_covariance,
                                         PoseMessage::tf};
/// "odometry", "pose", "pose_with_covariance" or "tf".
std::string_view name(PoseMessage message) noexcept;

/// How an estimator fills its nav_msgs/Odometry, read from its sources.
struct OdometryProfile {
  std::string_view name;   ///< of the key odometry.profile
  std::string_view frame;  ///< header.frame_id, unless [frames] says otherwise
  std::string_view child;  ///< child_frame_id; empty: frames.body
  Twist twist = Twist::body;
  std::string_view told;                       ///< the estimator, in messages
  double rate_least = OdometryTiming::kUsual;  ///< odometry.rate_least, unless the file says it, Hz
};

/// All of them; the first is the default.
std::span<const OdometryProfile> odometry_profiles() noexcept;

}  // namespace backwash::config
