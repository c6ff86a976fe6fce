// SPDX-License-Identifier: BSD-3-Clause
#include "core/config/odometry_profile.hpp"

namespace backwash::config {

std::string_view name(Twist twist) noexcept {
  return twist == Twist::body ? "body" : twist == Twist::world ? "world" : "none";
}

std::string_view name(PoseMessage message) noexcept {
  switch (message) {
    case PoseMessage::pose:
      return "pose";
    case PoseMessage::pose_with_covariance:
      return "pose_with_covariance";
    case PoseMessage::tf:
      return "tf";
    case PoseMessage::odometry:
      break;
  }
  return "odometry";
}

std::span<const OdometryProfile> odometry_profiles() noexcept {
  static constexpr OdometryProfile kProfiles[] = {
      {"ros", "odom", "", Twist::body, "an estimator that keeps to the message's definition"},
      {"vins_fusion", "world", "world", Twist::world, "VINS-Fusion"},
      {"fast_lio", "camera_init", "body", Twist::none, "FAST-LIO", 9},  // of a lidar at 10 Hz, jitter and all
      {"openvins", "global", "imu", Twist::body, "OpenVINS"},
      {"isaac_vslam", "odom", "base_link", Twist::body, "Isaac VSLAM"},
      {"custom", "odom", "", Twist::body, "an estimator of your own"},
  };
  return kProfiles;
}

}  // namespace backwash::config
