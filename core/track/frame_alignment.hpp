// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/types/state.hpp"

namespace backwash::track {

/// Pose of one body in one frame at one moment; both frames are z-up, so they differ by a yaw and a translation.
struct YawPose {
  Vec3 p = Vec3::Zero();  ///< m
  double yaw = 0;         ///< rad
};

/// Estimates local ← map, p_local = R_z(yaw) p_map + t, from the vehicle's pose in both frames at the same moments
/// (interfaces.md, "Frames between map, odometry and controller"). While learning it follows the newest samples;
/// frozen, it only watches how well they still agree.
class FrameAlignment {
 public:
  static constexpr double kMaxPosition = 0.05;                     ///< m: aligned below this residual
  static constexpr double kMaxYaw = 3.0 * 3.14159265358979 / 180;  ///< rad
  static constexpr int kMinSamples = 25;                           ///< half a second at 50 Hz

  /// One pair of poses, 20 ms after the last. Real-time: wait-free, no allocation.
  void update(const YawPose& in_map, const YawPose& in_local, bool learn) noexcept;
  /// Forgets everything: the next samples define the transform anew.
  void reset() noexcept { *this = FrameAlignment{}; }
  /// Enough samples, and their residuals (low-passed over 0.2 s) are small.
  bool aligned() const noexcept;
  double position_residual() const noexcept { return position_residual_; }  ///< m
  double yaw_residual() const noexcept { return yaw_residual_; }            ///< rad

  /// A command of the map frame in the controller's local frame. Real-time: wait-free, no allocation.
  Setpoint to_local(const Setpoint& in_map) const noexcept;

 private:
  Vec3 rotate(const Vec3& v) const noexcept;

  int samples_ = 0;
  double yaw_ = 0;
  Vec3 translation_ = Vec3::Zero();
  double position_residual_ = 0, yaw_residual_ = 0;
};

/// Angle wrapped to (−π, π], rad.
double wrap_angle(double angle) noexcept;

}  // namespace backwash::track
