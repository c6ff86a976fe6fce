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

/// Where a simulator tells it:
/// - a MAVLink device (tcp:127.0.0.1:5762, the second line): ArduPilot's SIM_STATE at 100 Hz. Position comes there in
///   steps of 11 mm, velocity exactly: the velocity is integrated and kept within the step.
/// - a path (/tmp/px4-sock-0): PX4's shell, asked 100 times a second for its ground-truth topics, which have 10 µm
///   (HIL_STATE_QUATERNION has steps of 11 mm and 1 cm/s).
std::unique_ptr<TruthSource> truth_source(const std::string& where);

}  // namespace backwash::autopilots
