// SPDX-License-Identifier: BSD-3-Clause
// What modes and reasons are called in the status, in logs and in core/track/README.md.
#include "core/track/supervisor.hpp"

namespace backwash::track {
namespace {

constexpr const char* kModeNames[kModes] = {"passive", "enabling", "tracking", "hold", "land", "quiet", "lifting"};

constexpr const char* kReasonNames[kReasons] = {
    "started",
    "enable requested",
    "operator request",
    "autopilot follows our set-points",
    "new trajectory accepted",
    "autopilot did not follow within 5 s",
    "odometry lost",
    "odometry jumped",
    "map and autopilot frames disagree",
    "error outside its reachable set for 3 ticks",
    "3 control deadlines missed within a second",
    "port to the autopilot lost",
    "port to the autopilot does not take set-points",
    "no heartbeat from the autopilot for 1.5 s",
    "autopilot left offboard",
    "disarmed",
    "landed",
    "land requested of the autopilot",
    "operator asks to land",
    "odometry stamps do not rise",
    "odometry frozen while moving",
    "no trusted pose for 0.3 s",
    "autopilot's position estimate was reset",
    "obstacle in the way",
    "vehicle outside the map",
    "live map older than 1 s",
    "no map was received",
    "battery low",
    "25 control periods missed in a row",
    "map and autopilot disagree along x",
    "map and autopilot disagree along y",
    "map and autopilot disagree along z",
    "map and autopilot disagree in yaw",
    "map and autopilot disagree in roll",
    "map and autopilot disagree in pitch",
    "operator asks to stop",
    "odometry contradicts its own velocity",
    "autopilot's pose older than 0.3 s",
    "no pose from the autopilot for 1 s",
    "loop closure beyond 1 m or 10 degrees",
    "take-off accepted",
    "lifted off",
    "not in the air 12 s after the take-off began",
    "outside the take-off's column for 3 ticks",
    "autopilot did not arm within 3 s",
    "map and autopilot frames come apart",
};

}  // namespace

const char* to_string(Mode mode) noexcept {
  const auto n = static_cast<std::size_t>(mode);
  return n < kModes ? kModeNames[n] : "?";
}

const char* to_string(Reason reason) noexcept {
  const auto n = static_cast<std::size_t>(reason);
  return n < kReasons ? kReasonNames[n] : "?";
}

}  // namespace backwash::track
