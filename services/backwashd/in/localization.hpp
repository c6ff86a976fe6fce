// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <tl/expected.hpp>

#include "core/config/daemon_config.hpp"
#include "core/track/pose_velocity.hpp"
#include "services/backwashd/in/received.hpp"
#include "services/dds/topics.hpp"

namespace backwash::daemon {

/// What the frames of incoming messages mean: odometry in the map's frame is taken as it is; odometry in the VIO's own
/// frame is brought into the map by the newest loop closure, map ← odom, and refused before the first. Used by the
/// reader thread alone. Errors are one line that says what would be right.
class Localization {
 public:
  /// `max_sigma`: estimation.position of the vehicle, m.
  Localization(const config::Daemon& config, double max_sigma);

  /// The body's pose and velocity, from those of the sensor, in the frames of the configured profile; without a twist
  /// the velocity is PoseVelocity's, and a sample before it is known is refused. Checks frames and covariance: a
  /// position that the VIO itself holds for worse than max_sigma is a bad one. A covariance of zeros, or whose first
  /// number is −1, is not known. A pose that is not finite, beyond 10 km or 100 m/s, or no rotation is refused; whether
  /// it is credible is for the odometry gate.
  tl::expected<OdometrySample, std::string> odometry(const dds::Odometry& message, std::int64_t received_ns);
  /// From now on, odometry is brought into the map by this transform; it turns about z only. One that differs from the
  /// one in use by no more than max_sigma, where the vehicle is, is no closure: the estimate may be off by as much. It
  /// changes nothing, and no plan is refused for it, until it differs by more: by what follows, or where a turn that
  /// was nothing here has come to matter.
  tl::expected<void, std::string> loop_closure(const dds::TransformStamped& message);
  std::uint32_t closures() const noexcept { return closures_; }
  /// The one in use; nothing before the first.
  const std::optional<track::RigidShift>& map_from_odom() const noexcept { return map_from_odom_; }

 private:
  std::string unusable(const dds::Odometry& message) const;
  void settle();
  double step_to(const track::RigidShift& newest) const;
  std::optional<Vec3> velocity(const dds::Odometry& message, std::int64_t stamp_ns, const Vec3& p_W,
                               const Eigen::Quaterniond& attitude, const Vec3& lever);

  decltype(config::Daemon::frames) frames_;
  config::Daemon::Odometry told_;
  Eigen::Quaterniond body_from_sensor_;
  double max_sigma_;
  track::PoseVelocity velocity_;       // in the VIO's own frame: no loop closure moves it
  bool velocity_of_odometry_ = false;  // whether that is frames.odometry
  std::optional<track::RigidShift> map_from_odom_;
  std::optional<track::RigidShift> newest_;  // not in use: no closure where the vehicle was last
  std::optional<Vec3> p_O_;                  // there, in the VIO's own frame
  std::uint32_t closures_ = 0;
};

/// The refusal of a message in a frame that is none of ours: what is in which frame, and which would be `right`.
tl::unexpected<std::string> wrong_frame(const std::string& what, const std::string& frame, const std::string& right);

}  // namespace backwash::daemon
