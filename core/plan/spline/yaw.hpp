// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/types/state.hpp"

namespace backwash::plan {

struct YawLimits {
  double rate = 1.0;          ///< rad/s; 0: the heading is held
  double acceleration = 2.0;  ///< rad/s²
};
/// Heading and its rate before the first command.
struct YawStart {
  double yaw = 0;   ///< rad
  double rate = 0;  ///< rad/s
};

/// The same commands with the heading turned to where the path leads 0.4 s ahead (kept where it leads nowhere), at most
/// `limits.rate` fast, changing by at most `limits.acceleration`, and at rest in the last command if the start allows
/// it. Continuous: it may pass ±π. Commands are 20 ms apart.
std::vector<Setpoint> facing_ahead(std::vector<Setpoint> commands, const YawStart& start, const YawLimits& limits);

/// Commands that stay where `at` is and turn from its heading, at rest, to `yaw` (rad, the short way) within the
/// limits; the last one is at rest there. Empty if the heading is reached already or the limits let nothing turn.
std::vector<Setpoint> turned_to(const Setpoint& at, double yaw, const YawLimits& limits);

}  // namespace backwash::plan
