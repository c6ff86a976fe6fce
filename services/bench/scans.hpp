// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "core/map/occupancy_grid.hpp"
#include "core/types/state.hpp"
#include "services/dds/topics.hpp"

namespace backwash::bench {

/// What a depth camera sees of a cube: points every 4 cm on the faces that look at it, m in W.
std::vector<Vec3> seen_of_crate(const Vec3& center_W, double edge, const Vec3& from_W);

/// What a range sensor that looks everywhere sees within 4 m, a ray every 10 degrees or so: points in occupied voxels,
/// and points 20 m away, beyond what counts, along rays that meet none, m in W. O(rays · range/a): some ms.
std::vector<Vec3> seen_of_room(const map::OccupancyGrid& room, const Vec3& from_W);

/// The emulated mapper's scans: clouds in the body's frame, as a sensor on the vehicle sends them.
class Scans {
 public:
  Scans(const dds::Participant& participant, const std::string& name_space)
      : writer_(dds::make_writer<dds::PointCloud>(participant, name_space)) {}
  /// Points as the vehicle at this pose sees them at time t, s.
  void send(const std::vector<Vec3>& points_W, const State& truth, const Eigen::Quaterniond& q, double t);

 private:
  dds::Writer<dds::PointCloud> writer_;
};

/// DDS time of t, s.
builtin_interfaces_msg_dds__Time_ stamp(double t);

}  // namespace backwash::bench
