// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>

#include "core/track/frame_alignment.hpp"

namespace backwash::track {

// The truth of the test: an isometry built by Eigen, applied to a vehicle that hovers with some noise.
struct Frames {
  Eigen::Isometry3d local_from_map;
  double yaw;
  Frames(double yaw_offset, const Vec3& t) : local_from_map(Eigen::Isometry3d::Identity()), yaw(yaw_offset) {
    local_from_map.rotate(Eigen::AngleAxisd(yaw_offset, Vec3::UnitZ())).pretranslate(t);
  }
  FramePose local(const FramePose& map) const { return {local_from_map * map.p, map.yaw + yaw}; }
};

}  // namespace backwash::track
