// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "core/track/frame_alignment.hpp"
#include "core/types/geometry.hpp"
#include "core/types/mode.hpp"
#include "core/types/odometry_timing.hpp"

namespace backwash::track {

/// What an operator asked for since the last tick. `hold` ends what was planned before it and changes no mode: a plan
/// that slows the flight down follows.
enum class Request : std::uint8_t { none, enable, disable, land, stop, hold };

/// A request with its number, which rises with each; 0: none.
struct Order {
  Request request = Request::none;
  std::uint64_t number = 0;
};

/// Facts of this tick. Ages in s; a thing never received has an infinite age.
struct SupervisorInput {
  Request request = Request::none;
  double odometry_age = 0;             ///< since the last good sample
  bool odometry_jump = false;          ///< the newest sample failed the innovation gate
  bool odometry_inconsistent = false;  ///< its positions go another way than its velocities
  bool odometry_frozen = false;        ///< five identical samples under commanded motion
  bool odometry_disorder = false;      ///< more than three stamps in a row did not rise
  double heartbeat_age = 0;            ///< since the autopilot's last heartbeat
  double pose_age = 0;                 ///< of the older of its position and its attitude
  bool armed = false;
  bool arming = false;           ///< it was asked to arm a moment ago: its next heartbeat may say so
  bool lifts_itself = false;     ///< it takes off by a command of its own and ignores set-points on the ground
  bool lifted = false;           ///< the vehicle is in the air, at the height of the take-off that was accepted
  bool offboard = false;         ///< the autopilot follows our set-points
  bool frames_aligned = false;   ///< residual of local ← map below 5 cm and 3°
  bool frames_apart = false;     ///< in flight, further apart than the two estimates' own errors explain
  bool frames_agree = true;      ///< in flight: not twice as far, and neither turned nor tilted
  bool autopilot_reset = false;  ///< its estimator was reset this tick; local ← map was taken anew
  bool closure_refused = false;  ///< a loop closure came that is too large to be flown
  Mismatch mismatch = Mismatch::none;
  bool inside = true;           ///< measured error inside the set predicted for it; lifting: inside any of the column
  bool new_segment = false;     ///< the tracker was given a segment
  bool takeoff = false;         ///< that is a take-off
  bool obstacle_ahead = false;  ///< something new reaches into the sets still to be flown
  bool air_rougher = false;     ///< these are not clear any more in the air as the flight has learnt it
  bool outside_map = false;     ///< the newest pose is outside the map
  bool map_late = false;        ///< a live map is older than 1 s
  bool map_missing = false;     ///< there is no map
  bool battery_low = false;     ///< below the configured share
  bool port_open = true;
  bool transmit_failed = false;  ///< two set-points in a row could not be sent
  bool line_slow = false;        ///< the line adds more delay than the sets are computed for
  int missed_periods = 0;        ///< whole periods skipped before this tick
};

/// What this tick sends.
struct SupervisorOutput {
  Mode mode = Mode::passive;
  Reason reason = Reason::started;
  bool changed = false;  ///< mode or reason differ from the last tick
  bool send_setpoint = false;
  bool freeze = false;  ///< hold with an untrusted pose: the last good set-point, no new positions
  bool send_heartbeat = false;
  bool request_offboard = false;
  bool request_land = false;
};

using ModeSet = std::uint8_t;  ///< bit n: Mode n
constexpr ModeSet set_of(std::initializer_list<Mode> modes) noexcept {
  unsigned set = 0;
  for (const Mode m : modes) set |= 1u << static_cast<unsigned>(m);
  return static_cast<ModeSet>(set);
}
constexpr bool contains(ModeSet set, Mode m) noexcept { return set >> static_cast<unsigned>(m) & 1; }
/// Modes in which the daemon acts on the vehicle, and of these the ones whose set-points the autopilot follows.
inline constexpr ModeSet kCommanding = set_of({Mode::enabling, Mode::lifting, Mode::tracking, Mode::hold, Mode::land});
inline constexpr ModeSet kFollowed = set_of({Mode::tracking, Mode::hold});
constexpr bool commanding(Mode m) noexcept { return contains(kCommanding, m); }

/// In one of the modes `from`, when the fact that `when` names occurs: to mode `to`. The first row that applies is
/// taken, one a tick.
struct Transition {
  ModeSet from;
  Reason when;
  Mode to;
};
/// All transitions but that of an enable request, in the order in which they are tried.
std::span<const Transition> transitions() noexcept;
/// Why a request to enable (in passive or quiet) is refused, in the order in which they are tried: the mode stays and
/// the reason says so. If none occurs: → enabling.
std::span<const Reason> refusals() noexcept;

/// Which reasons there are in one tick to change the mode, or to refuse to enable.
class Occurring {
 public:
  bool& operator[](Reason reason) noexcept { return is_[static_cast<std::size_t>(reason)]; }
  bool operator[](Reason reason) const noexcept { return is_[static_cast<std::size_t>(reason)]; }

 private:
  std::array<bool, kReasons> is_{};
};

/// The daemon's explicit states and reactions: a pure function of the facts of each tick (docs/faults.md).
class Supervisor {
 public:
  /// s without odometry until HOLD and LAND (docs/faults.md row 1: 100 and 400 ms), of slower odometry the longer gap
  /// later.
  static constexpr double kHoldAfter = OdometryTiming::kHoldAfter, kLandAfter = 0.38;
  static constexpr double kUntrusted = 0.30;     ///< s of hold with an untrusted pose until LAND
  static constexpr double kHeartbeatLost = 1.5;  ///< s (row 21)
  static constexpr double kPoseSilent = 0.3;     ///< s without the autopilot's position or attitude (row 42)
  static constexpr double kPoseLost = 1.0;       ///< s of that until LAND (row 42)
  static constexpr double kEnableTimeout = 5.0;  ///< s from the request until the autopilot must follow
  static constexpr double kStreamBefore = 1.0;   ///< s of set-points before offboard is asked for (PX4 wants a stream)
  static constexpr int kOutsideTicks = 3;        ///< row 16
  static constexpr double kLiftTimeout = 12.0;   ///< s from the take-off's acceptance until it must be in the air
  static constexpr std::int64_t kMissedWithin = 50;  ///< periods in which three missed ones lead to hold (row 32)
  static constexpr int kMissedQuiet = 25;            ///< missed periods in a row until QUIET (row 32)
  /// LAND is asked for twice in these, one command may be lost; and twice more each time that an operator asks again.
  static constexpr int kLandTicks = 10;

  explicit Supervisor(const OdometryTiming& timing = {}) noexcept : longer_gap_(timing.longer_gap()) {}

  /// Real-time: wait-free, no allocation.
  SupervisorOutput step(const SupervisorInput& in) noexcept;
  Mode mode() const noexcept { return mode_; }
  Reason reason() const noexcept { return reason_; }
  /// Whether the autopilot's pose is too old to be flown by, at this age, s (row 42).
  static constexpr bool silent(double pose_age) noexcept { return pose_age > kPoseSilent - kControlPeriod / 2; }
  /// s without odometry until HOLD.
  double hold_after() const noexcept { return kHoldAfter + longer_gap_; }
  /// False in a hold whose cause speaks against the pose.
  bool pose_trusted() const noexcept;

 private:
  void enter(Mode mode, Reason reason) noexcept;
  void count(const SupervisorInput& in) noexcept;
  Occurring occurring(const SupervisorInput& in) const noexcept;
  void note_link_and_operator(const SupervisorInput& in, Occurring& now) const noexcept;
  void note_poses(const SupervisorInput& in, Occurring& now) const noexcept;
  void note_flight(const SupervisorInput& in, Occurring& now) const noexcept;
  double seconds_in_mode() const noexcept;
  SupervisorOutput output(const SupervisorInput& in) noexcept;

  double longer_gap_;
  Mode mode_ = Mode::passive;
  Reason reason_ = Reason::started;
  bool changed_ = true;
  int ticks_in_mode_ = 0;
  int outside_ = 0;
  bool was_armed_ = false;
  bool battery_landed_ = false;  ///< once (row 24)
  std::int64_t period_ = 0;      ///< number of this tick's period
  /// The three newest missed periods, oldest first.
  std::array<std::int64_t, 3> missed_{-2 * kMissedWithin, -2 * kMissedWithin, -2 * kMissedWithin};
};

}  // namespace backwash::track
