// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace backwash::track {

/// What the daemon does with the vehicle. core/track/README.md has the transition table.
enum class Mode : std::uint8_t {
  passive,   ///< nothing is commanded; an operator has to enable
  enabling,  ///< set-points of the present place are streamed until the autopilot follows them
  tracking,  ///< set-points come from the tracker: accepted segments, then their end
  hold,      ///< the last good set-point, frozen with zero velocity and acceleration
  land,      ///< the autopilot's own land mode was asked for; no set-points
  quiet,     ///< neither set-points nor heartbeat: the autopilot's failsafe acts
};
const char* to_string(Mode mode) noexcept;

/// Why the mode is what it is; faults.md has the rows.
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
};
const char* to_string(Reason reason) noexcept;

/// What an operator asked for since the last tick.
enum class Request : std::uint8_t { none, enable, disable, land };

/// Facts of this tick. Ages in s; a thing never received has an infinite age.
struct SupervisorInput {
  Request request = Request::none;
  double odometry_age = 0;     ///< since the last good sample
  bool odometry_jump = false;  ///< the newest sample failed the innovation gate
  double heartbeat_age = 0;    ///< since the autopilot's last heartbeat
  bool armed = false;
  bool offboard = false;        ///< the autopilot follows our set-points
  bool landed = false;          ///< the autopilot says it is on the ground
  bool frames_aligned = false;  ///< residual of local ← map below 5 cm and 3°
  bool inside = true;           ///< measured error inside the set predicted for it
  bool new_segment = false;     ///< the tracker was given a segment
  bool port_open = true;
  bool transmit_failed = false;  ///< two set-points in a row could not be sent
  int missed_periods = 0;        ///< whole periods skipped before this tick
};

/// What this tick sends.
struct SupervisorOutput {
  Mode mode = Mode::passive;
  Reason reason = Reason::started;
  bool changed = false;  ///< mode or reason differ from the last tick
  bool send_setpoint = false;
  bool freeze = false;  ///< the set-point is the last good one with zero velocity and acceleration
  bool send_heartbeat = false;
  bool forward_odometry = false;
  bool request_offboard = false;
  bool request_land = false;
};

/// The daemon's explicit states and reactions: a pure function of the facts of each tick (faults.md).
class Supervisor {
 public:
  static constexpr double kHoldAfter = 0.08;     ///< s without odometry until HOLD (faults.md row 1: 100 ms)
  static constexpr double kLandAfter = 0.38;     ///< s without odometry until LAND (row 1: 400 ms)
  static constexpr double kHeartbeatLost = 1.5;  ///< s (row 21)
  static constexpr double kEnableTimeout = 5.0;  ///< s from the request until the autopilot must follow
  static constexpr double kStreamBefore = 1.0;   ///< s of set-points before offboard is asked for (PX4 wants a stream)
  static constexpr int kOutsideTicks = 3;        ///< row 16
  static constexpr int kMissedQuiet = 25;        ///< missed periods in a row until QUIET (row 32)

  /// Real-time: wait-free, no allocation.
  SupervisorOutput step(const SupervisorInput& in) noexcept;
  Mode mode() const noexcept { return mode_; }
  Reason reason() const noexcept { return reason_; }

 private:
  void enter(Mode mode, Reason reason) noexcept;
  bool link_faults(const SupervisorInput& in) noexcept;
  void enabling(const SupervisorInput& in) noexcept;
  void tracking(const SupervisorInput& in) noexcept;
  void holding(const SupervisorInput& in) noexcept;
  void landing(const SupervisorInput& in) noexcept;

  Mode mode_ = Mode::passive;
  Reason reason_ = Reason::started;
  bool changed_ = true;
  int ticks_in_mode_ = 0;
  int outside_ = 0;
  bool was_armed_ = false;
};

}  // namespace backwash::track
