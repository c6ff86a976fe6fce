// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "core/types/geometry.hpp"

namespace backwash::autopilots {

/// What a simulator says of its vehicle. The frame E is z-up (east, north, up) with its origin where the vehicle first
/// stood; the body is FLU.
struct Truth {
  std::int64_t at_ns = 0;  ///< CLOCK_MONOTONIC
  Vec3 p_E = Vec3::Zero(), v_E = Vec3::Zero();
  Eigen::Quaterniond q_EB = Eigen::Quaterniond::Identity();
  Vec3 omega_B = Vec3::Zero();
};

class TruthSource {
 public:
  virtual ~TruthSource() = default;
  /// The newest that has arrived since the last call. Throws std::runtime_error when the simulator has gone.
  virtual std::optional<Truth> newest() = 0;
};

/// ArduPilot's SIM_STATE at 100 Hz on a second MAVLink line (its TCP port 5762). Position comes there in steps of 11
/// mm, velocity exactly: the velocity is integrated and kept within the step.
std::unique_ptr<TruthSource> ardupilot_truth(const std::string& device);

/// What PX4's own `listener` prints of vehicle_local_position_groundtruth and vehicle_attitude_groundtruth (to 10 µm;
/// HIL_STATE_QUATERNION has steps of 11 mm and 1 cm/s): files, usually pipes, that it writes.
std::unique_ptr<TruthSource> px4_truth(const std::string& position_file, const std::string& attitude_file);

}  // namespace backwash::autopilots
