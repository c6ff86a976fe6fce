// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/types/geometry.hpp"

namespace backwash {

/// Translational state of the vehicle in the world frame (z up).
struct State {
  Vec3 p_W = Vec3::Zero();  ///< position, m
  Vec3 v_W = Vec3::Zero();  ///< velocity, m/s
};

/// One position command, held for one control period (docs/model.md section 4).
struct Setpoint {
  Vec3 p_W = Vec3::Zero();  ///< position, m
  Vec3 v_W = Vec3::Zero();  ///< velocity, m/s
  Vec3 a_W = Vec3::Zero();  ///< acceleration feed-forward, gravity removed, m/s²
  double yaw = 0.0;         ///< heading of the body x axis from world x, counter-clockwise, rad
};

}  // namespace backwash
