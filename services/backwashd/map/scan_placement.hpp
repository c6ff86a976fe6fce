// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <deque>
#include <optional>
#include <string>
#include <tl/expected.hpp>

#include "core/config/daemon_config.hpp"
#include "services/backwashd/in/received.hpp"
#include "services/backwashd/map/cloud.hpp"

namespace backwash::daemon {

/// Places scans in the map: points in the body's frame by the odometry at their stamp, points in the VIO's frame by the
/// newest loop closure. Used by the thread that reads scans alone, which is told of odometry and closures by the one
/// that reads those.
class ScanPlacement {
 public:
  /// `body_radius`: of the vehicle, m: what a scan sees nearer to its middle is the vehicle itself, or no return.
  explicit ScanPlacement(const config::Daemon& config, double body_radius = 0)
      : frames_(config.frames),
        body_radius_(body_radius),
        most_apart_ns_(std::llround(2e9 / config.odometry.timing.rate_least)) {}

  /// A pose in the map. One behind a loop closure moves the poses before it into the new map frame.
  void add(const OdometrySample& sample);
  /// The newest loop closure, map ← odom.
  void close(const track::RigidShift& map_from_odom) { map_from_odom_ = map_from_odom; }
  /// The sensor is the cloud's viewpoint, or, without one, the body's origin. The vehicle itself is left out. Error:
  /// one line that says what would be right.
  tl::expected<Scan, std::string> scan(const dds::PointCloud& message, std::int64_t received_ns) const;

  /// Where the newest pose is, m in the map.
  std::optional<Vec3> newest_W() const { return history_.empty() ? std::nullopt : std::optional(history_.back().p); }
  /// Held now; bounded whatever is added.
  std::size_t poses() const noexcept { return history_.size(); }

 private:
  struct Pose {
    std::int64_t stamp_ns;
    Vec3 p;  // in the map
    std::array<double, 4> q;
  };
  std::optional<Pose> pose_at(std::int64_t stamp_ns) const;

  decltype(config::Daemon::frames) frames_;
  double body_radius_;
  std::int64_t most_apart_ns_;  // of two poses: between them a scan has a place
  std::optional<track::RigidShift> map_from_odom_;
  std::uint32_t closures_ = 0;           // of the newest pose
  track::RigidShift history_from_odom_;  // of that pose
  std::deque<Pose> history_;             // of the last second, by rising stamps
};

/// The voxels of `known` that a point of the scan lies in and that are free there, as news() has them: a flight is
/// verified through free voxels alone.
NewVoxels new_voxels(const map::OccupancyGrid& known, const Scan& scan, double max_range);

}  // namespace backwash::daemon
