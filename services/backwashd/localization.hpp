// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "core/config/daemon_config.hpp"
#include "services/backwashd/channels.hpp"
#include "services/backwashd/cloud.hpp"

namespace backwash::daemon {

/// What the frames of incoming messages mean: odometry in the map's frame is taken as it is; odometry in the VIO's own
/// frame is brought into the map by the newest loop closure, map ← odom, and refused before the first. Used by the
/// reader thread alone. Errors are one line that says what would be right.
class Localization {
 public:
  /// `max_sigma`: estimation.position of the vehicle, m.
  Localization(const config::Daemon& config, double max_sigma) : frames_(config.frames), max_sigma_(max_sigma) {}

  /// Checks frames and covariance: a position that the VIO itself holds for worse than max_sigma is a bad one. A
  /// covariance whose first number is 0 or −1 is not known. A pose that is not finite, beyond 10 km or 100 m/s, or
  /// no rotation is refused; whether it is credible is for the odometry gate.
  tl::expected<OdometrySample, std::string> odometry(const dds::Odometry& message, std::int64_t received_ns);
  /// From now on, odometry is brought into the map by this transform; it turns about z only. A message that repeats the
  /// last transform changes nothing.
  tl::expected<void, std::string> loop_closure(const dds::TransformStamped& message);
  /// A scan in the map: points in the body's frame are placed by the odometry at their stamp, points in the VIO's frame
  /// by the loop closure. The sensor is the cloud's viewpoint, or, without one, the body's origin.
  tl::expected<Scan, std::string> scan(const dds::PointCloud& message, std::int64_t received_ns) const;
  std::uint32_t closures() const noexcept { return closures_; }
  std::size_t poses_kept() const noexcept { return history_.size(); }

 private:
  struct Pose {
    std::int64_t stamp_ns;
    Vec3 p;  // in the map
    std::array<double, 4> q;
  };
  std::optional<Pose> pose_at(std::int64_t stamp_ns) const;

  decltype(config::Daemon::frames) frames_;
  double max_sigma_;
  std::optional<track::RigidShift> map_from_odom_;
  std::uint32_t closures_ = 0;
  std::deque<Pose> history_;  // of the last second, stamps rising, at most 1,000
};

/// The voxels of `known` that a point of the scan lies in and that are not occupied there, as cubes: at most
/// NewVoxels::kMost, in larger cubes of the grid's lattice if there are more. O(points).
NewVoxels new_voxels(const map::OccupancyGrid& known, const Scan& scan, double max_range);

}  // namespace backwash::daemon
