// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>

#include "services/backwash/plan/logged_vehicle.hpp"

namespace backwash::services {

/// Proportional gains of the loop, 1/s, as a flight shows them.
struct ShownGains {
  /// Of position and of velocity; along x and y, and along z. Nothing: they cannot be told, because the log lacks the
  /// set-points, or because they hardly leave what was flown.
  std::array<std::optional<Shown>, 2> position, velocity;
};

/// How the velocity's set-point goes with the error of the position, and the acceleration's with that of the velocity,
/// what was fed forward taken off: Frisch's bounds (docs/model.md, 3-9), between them their geometric mean. Set-points
/// are those that the controller followed (vehicle_local_position_setpoint), which PX4 logs.
ShownGains shown_gains(const log::TopicLog& topics);

}  // namespace backwash::services
