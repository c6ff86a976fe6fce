// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace backwash {

/// What the daemon does with the vehicle. docs/modes.md has the transition table.
enum class Mode : std::uint8_t {
  passive,   ///< nothing is commanded; an operator has to enable
  enabling,  ///< set-points of the present place are streamed until the autopilot follows them
  tracking,  ///< set-points come from the tracker: accepted segments, then their end
  hold,      ///< a verified stop to rest, or the last good set-point frozen with zero velocity and acceleration
  land,      ///< the autopilot's own land mode was asked for; no set-points
  quiet,     ///< neither set-points nor heartbeat: the autopilot's failsafe acts
  lifting,   ///< a take-off was accepted: motors start, and the vehicle leaves the ground by the autopilot's own means
};

/// Why the mode is what it is; docs/faults.md has the rows.
enum class Reason : std::uint8_t {
  started,
  enabled,
  operator_request,
  autopilot_follows,
  segment_accepted,
  enable_timeout,
  odometry_lost,
  odometry_jump,
  frames_disagree,
  outside_set,
  deadline_missed,
  port_lost,
  transmit_full,
  autopilot_silent,
  offboard_left,
  disarmed,
  landed,
  land_sent,
  land_requested,
  odometry_disorder,
  odometry_frozen,
  pose_untrusted,
  autopilot_reset,
  obstacle_ahead,
  outside_map,
  map_late,
  map_missing,
  battery_low,
  clock_stopped,
  frame_mismatch_x,
  frame_mismatch_y,
  frame_mismatch_z,
  frame_mismatch_yaw,
  frame_mismatch_roll,
  frame_mismatch_pitch,
  stop_requested,
  odometry_inconsistent,
  pose_silent,
  pose_lost,
  closure_refused,
  takeoff_accepted,
  lifted_off,
  lift_timeout,
  outside_column,
  not_armed,
  frames_apart,
  air_rougher,
  line_slow,
};

/// In what two descriptions of the same motion contradict each other: an axis of the map, or an angle.
enum class Mismatch : std::uint8_t { none, x, y, z, yaw, roll, pitch };

// What they are called in the status, in logs and in docs/modes.md, in the enumerations' order.
inline constexpr std::array kModeNames{"passive", "enabling", "tracking", "hold", "land", "quiet", "lifting"};
inline constexpr std::array kMismatchNames{"none", "x", "y", "z", "yaw", "roll", "pitch"};
inline constexpr std::array kReasonNames{
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
    "air rougher than the flight allows for",
    "line to the autopilot slower than sets allow for",
};
inline constexpr int kModes = kModeNames.size(), kReasons = kReasonNames.size();
static_assert(kModes == 1 + static_cast<int>(Mode::lifting));
static_assert(kReasons == 1 + static_cast<int>(Reason::line_slow));
static_assert(kMismatchNames.size() == 1 + static_cast<std::size_t>(Mismatch::pitch));

/// How the status's task begins when the plan for the last command was refused; why follows.
inline constexpr std::string_view kRefusedTask = "refused: ";

namespace detail {

template <typename Enum, std::size_t kCount>
constexpr const char* name_of(Enum value, const std::array<const char*, kCount>& names) noexcept {
  const auto n = static_cast<std::size_t>(value);
  return n < kCount ? names[n] : "?";
}

template <typename Enum, std::size_t kCount>
constexpr std::optional<Enum> named(std::string_view name, const std::array<const char*, kCount>& names) noexcept {
  for (std::size_t n = 0; n < kCount; ++n)
    if (name == names[n]) return static_cast<Enum>(n);
  return std::nullopt;
}

}  // namespace detail

constexpr const char* to_string(Mode mode) noexcept { return detail::name_of(mode, kModeNames); }
constexpr const char* to_string(Reason reason) noexcept { return detail::name_of(reason, kReasonNames); }
constexpr const char* to_string(Mismatch mismatch) noexcept { return detail::name_of(mismatch, kMismatchNames); }

/// What has this name; nothing: none here, as of a daemon of another version.
constexpr std::optional<Mode> mode_named(std::string_view name) noexcept {
  return detail::named<Mode>(name, kModeNames);
}
constexpr std::optional<Reason> reason_named(std::string_view name) noexcept {
  return detail::named<Reason>(name, kReasonNames);
}
constexpr std::optional<Mismatch> mismatch_named(std::string_view name) noexcept {
  return detail::named<Mismatch>(name, kMismatchNames);
}

}  // namespace backwash
