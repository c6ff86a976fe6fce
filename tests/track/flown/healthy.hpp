// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/track/supervisor.hpp"

namespace backwash::track {

/// Facts of a flight in which all is well.
inline SupervisorInput healthy() {
  SupervisorInput in;
  in.odometry_age = 0.01;
  in.heartbeat_age = 0.5;
  in.armed = in.offboard = in.frames_aligned = true;
  return in;
}

}  // namespace backwash::track
