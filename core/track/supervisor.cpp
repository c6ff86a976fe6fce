// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/supervisor.hpp"

#include <algorithm>

#include "core/types/geometry.hpp"

namespace backwash::track {
namespace {

constexpr ModeSet kCommanding = set_of({Mode::enabling, Mode::lifting, Mode::tracking, Mode::hold, Mode::land});
constexpr ModeSet kFollowed = set_of({Mode::tracking, Mode::hold});
constexpr ModeSet kEnabling = set_of({Mode::enabling}), kTracking = set_of({Mode::tracking});
constexpr ModeSet kHold = set_of({Mode::hold}), kLand = set_of({Mode::land}), kLifting = set_of({Mode::lifting});

// core/track/README.md shows this table; a test compares the two.
constexpr Transition kTransitions[] = {
    // Without a working link or a working clock nothing may be streamed.
    {kCommanding, Reason::port_lost, Mode::quiet},
    {kCommanding, Reason::transmit_full, Mode::quiet},
    {kCommanding, Reason::autopilot_silent, Mode::quiet},
    {kCommanding, Reason::clock_stopped, Mode::quiet},
    {kEnabling, Reason::operator_request, Mode::passive},
    {kEnabling, Reason::offboard_left, Mode::passive},
    {kEnabling, Reason::odometry_lost, Mode::passive},
    {kEnabling, Reason::odometry_jump, Mode::passive},
    {kEnabling, Reason::odometry_inconsistent, Mode::passive},
    {kEnabling, Reason::pose_silent, Mode::passive},
    {kEnabling, Reason::closure_refused, Mode::passive},
    {kEnabling, Reason::frame_mismatch_x, Mode::passive},
    {kEnabling, Reason::frame_mismatch_y, Mode::passive},
    {kEnabling, Reason::frame_mismatch_z, Mode::passive},
    {kEnabling, Reason::frame_mismatch_yaw, Mode::passive},
    {kEnabling, Reason::frame_mismatch_roll, Mode::passive},
    {kEnabling, Reason::frame_mismatch_pitch, Mode::passive},
    {kEnabling, Reason::autopilot_follows, Mode::tracking},
    {kEnabling, Reason::enable_timeout, Mode::passive},
    // Below the lowest safe hover height no hold is verified: what ends a lift-off lands.
    {kLifting, Reason::offboard_left, Mode::passive},
    {kLifting, Reason::disarmed, Mode::passive},
    {kLifting, Reason::not_armed, Mode::passive},
    {kLifting, Reason::land_requested, Mode::land},
    {kLifting, Reason::stop_requested, Mode::land},
    {kLifting, Reason::pose_silent, Mode::land},
    {kLifting, Reason::odometry_jump, Mode::land},
    {kLifting, Reason::odometry_inconsistent, Mode::land},
    {kLifting, Reason::odometry_frozen, Mode::land},
    {kLifting, Reason::odometry_disorder, Mode::land},
    {kLifting, Reason::odometry_lost, Mode::land},
    {kLifting, Reason::frames_disagree, Mode::land},
    {kLifting, Reason::autopilot_reset, Mode::land},
    {kLifting, Reason::closure_refused, Mode::land},
    {kLifting, Reason::battery_low, Mode::land},
    {kLifting, Reason::obstacle_ahead, Mode::land},
    {kLifting, Reason::outside_map, Mode::land},
    {kLifting, Reason::map_late, Mode::land},
    {kLifting, Reason::outside_column, Mode::land},
    {kLifting, Reason::lift_timeout, Mode::land},
    {kLifting, Reason::lifted_off, Mode::tracking},
    // The autopilot, its pilot and the operator come before everything that we notice.
    {kFollowed, Reason::offboard_left, Mode::passive},
    {kFollowed, Reason::disarmed, Mode::passive},
    {kFollowed, Reason::land_requested, Mode::land},
    {kFollowed, Reason::operator_request, Mode::passive},
    {kHold, Reason::pose_untrusted, Mode::land},
    {kFollowed, Reason::pose_lost, Mode::land},
    {kFollowed, Reason::odometry_jump, Mode::hold},
    {kFollowed, Reason::odometry_inconsistent, Mode::hold},
    {kFollowed, Reason::odometry_frozen, Mode::hold},
    {kFollowed, Reason::odometry_disorder, Mode::hold},
    {kFollowed, Reason::odometry_lost, Mode::hold},
    {kFollowed, Reason::frames_disagree, Mode::hold},
    {kFollowed, Reason::frames_apart, Mode::hold},
    {kFollowed, Reason::battery_low, Mode::land},
    {kFollowed, Reason::autopilot_reset, Mode::hold},
    {kFollowed, Reason::pose_silent, Mode::hold},
    {kFollowed, Reason::closure_refused, Mode::hold},
    {kFollowed, Reason::stop_requested, Mode::hold},
    {kTracking, Reason::obstacle_ahead, Mode::hold},
    {kTracking, Reason::outside_map, Mode::hold},
    {kTracking, Reason::map_late, Mode::hold},
    {kTracking, Reason::outside_set, Mode::hold},
    {kTracking, Reason::deadline_missed, Mode::hold},
    {kTracking, Reason::takeoff_accepted, Mode::lifting},
    {kHold, Reason::segment_accepted, Mode::tracking},
    {kLand, Reason::landed, Mode::passive},
    {kLand, Reason::land_sent, Mode::quiet},
};

constexpr Reason kRefusals[] = {
    Reason::port_lost,        Reason::autopilot_silent,   Reason::odometry_lost,       Reason::pose_silent,
    Reason::map_missing,      Reason::outside_map,        Reason::frame_mismatch_x,    Reason::frame_mismatch_y,
    Reason::frame_mismatch_z, Reason::frame_mismatch_yaw, Reason::frame_mismatch_roll, Reason::frame_mismatch_pitch,
};

// A pose that these speak of is not to be flown by.
constexpr bool distrusts(Reason reason) noexcept {
  return reason == Reason::odometry_jump || reason == Reason::odometry_lost || reason == Reason::odometry_frozen ||
         reason == Reason::odometry_disorder || reason == Reason::odometry_inconsistent ||
         reason == Reason::frames_disagree;
}

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

std::span<const Transition> transitions() noexcept { return kTransitions; }
std::span<const Reason> refusals() noexcept { return kRefusals; }

bool Supervisor::pose_trusted() const noexcept { return !distrusts(reason_); }
double Supervisor::seconds_in_mode() const noexcept { return ticks_in_mode_ * kControlPeriod; }

void Supervisor::enter(Mode mode, Reason reason) noexcept {
  if (mode == mode_ && reason == reason_) return;
  // A hold that comes to distrust the pose begins anew: its time is limited.
  if (mode != mode_ || (mode == Mode::hold && distrusts(reason) && pose_trusted())) ticks_in_mode_ = 0, outside_ = 0;
  mode_ = mode;
  reason_ = reason;
  changed_ = true;
}

void Supervisor::count(const SupervisorInput& in) noexcept {
  ++ticks_in_mode_;
  for (int missed = 0; missed < std::min(in.missed_periods, 3); ++missed) {
    std::rotate(missed_.begin(), missed_.begin() + 1, missed_.end());
    missed_.back() = period_ + in.missed_periods;
  }
  period_ += 1 + in.missed_periods;
  outside_ = (mode_ != Mode::tracking && mode_ != Mode::lifting) || in.inside ? 0 : outside_ + 1;
  if (!in.battery_low) battery_landed_ = false;
}

bool Supervisor::refused(Reason reason, const SupervisorInput& in) const noexcept {
  return reason == Reason::map_missing ? in.map_missing : occurs(reason, in);
}

bool Supervisor::occurs(Reason reason, const SupervisorInput& in) const noexcept {
  switch (reason) {
    case Reason::port_lost:
      return !in.port_open;  // row 17
    case Reason::transmit_full:
      return in.transmit_failed;  // row 20
    case Reason::autopilot_silent:
      return in.heartbeat_age > kHeartbeatLost;  // row 21
    case Reason::clock_stopped:
      return in.missed_periods >= kMissedQuiet;  // row 32
    case Reason::operator_request:
      return (in.request == Request::disable || in.request == Request::stop) &&
             (mode_ == Mode::enabling || !(in.armed || in.arming));
    case Reason::stop_requested:
      // A disable that comes when the vehicle may have left the ground.
      return in.request == Request::stop || in.request == Request::disable;
    case Reason::land_requested:
      return in.request == Request::land;
    case Reason::autopilot_follows:
      return in.offboard && in.frames_aligned;
    case Reason::enable_timeout:
      return seconds_in_mode() > kEnableTimeout;
    case Reason::offboard_left:
      // Rows 22 and 25; while enabling, of one that followed already and waited for the frames to agree.
      return !in.offboard && (mode_ != Mode::enabling || reason_ == Reason::autopilot_follows);
    case Reason::disarmed:
      return was_armed_ && !in.armed;  // row 23
    case Reason::odometry_jump:
      return in.odometry_jump;  // row 3
    case Reason::odometry_inconsistent:
      return in.odometry_inconsistent;  // row 41
    case Reason::pose_silent:
      return silent(in.pose_age);  // row 42
    case Reason::pose_lost:
      return in.pose_age > kPoseLost - kControlPeriod / 2;
    case Reason::closure_refused:
      return in.closure_refused;
    case Reason::odometry_frozen:
      return in.odometry_frozen;  // row 6
    case Reason::odometry_disorder:
      return in.odometry_disorder;  // row 5
    case Reason::odometry_lost:
      return in.odometry_age > kHoldAfter;  // rows 1, 2
    case Reason::pose_untrusted:
      return in.odometry_age > kLandAfter || (!pose_trusted() && seconds_in_mode() > kUntrusted);
    case Reason::frames_disagree:
      return !in.frames_agree;
    case Reason::frames_apart:
      return in.frames_apart;
    case Reason::battery_low:
      return in.battery_low && !battery_landed_;  // row 24
    case Reason::autopilot_reset:
      return in.autopilot_reset;  // row 8
    case Reason::obstacle_ahead:
      return in.obstacle_ahead;  // row 14
    case Reason::outside_map:
      return in.outside_map;  // row 9
    case Reason::map_late:
      return in.map_late;  // row 13
    case Reason::outside_set:
    case Reason::outside_column:
      return outside_ >= kOutsideTicks;  // row 16
    case Reason::takeoff_accepted:
      return in.new_segment && in.takeoff;
    case Reason::not_armed:
      return !in.armed && !in.arming;
    case Reason::lifted_off:
      return in.lifted;
    case Reason::lift_timeout:
      return seconds_in_mode() > kLiftTimeout;
    case Reason::deadline_missed:
      return in.missed_periods > 0 && missed_.front() >= period_ - 1 - kMissedWithin;  // row 32
    case Reason::segment_accepted:
      return in.new_segment && pose_trusted() && !in.frames_apart;
    case Reason::landed:
      return !in.armed && !in.arming;
    case Reason::land_sent:
      return reason_ == Reason::pose_untrusted && ticks_in_mode_ >= kLandTicks;
    case Reason::frame_mismatch_x:
      return in.mismatch == Mismatch::x;  // row 7
    case Reason::frame_mismatch_y:
      return in.mismatch == Mismatch::y;
    case Reason::frame_mismatch_z:
      return in.mismatch == Mismatch::z;
    case Reason::frame_mismatch_yaw:
      return in.mismatch == Mismatch::yaw;
    case Reason::frame_mismatch_roll:
      return in.mismatch == Mismatch::roll;
    case Reason::frame_mismatch_pitch:
      return in.mismatch == Mismatch::pitch;
    default:
      return false;
  }
}

SupervisorOutput Supervisor::step(const SupervisorInput& in) noexcept {
  count(in);
  const Mode before = mode_;
  const bool again = in.request == Request::land || in.request == Request::stop;
  if (mode_ == Mode::land && again && reason_ != Reason::pose_untrusted) ticks_in_mode_ = 0;
  if (!contains(kCommanding, mode_)) {
    if (in.request == Request::enable) {
      const auto* why = std::ranges::find_if(kRefusals, [&](Reason r) { return refused(r, in); });
      if (why == std::ranges::end(kRefusals))
        enter(Mode::enabling, Reason::enabled);
      else
        enter(mode_, *why);
    }
  } else {
    for (const Transition& t : kTransitions) {
      if (!contains(t.from, mode_) || !occurs(t.when, in)) continue;
      // A hold on a pose that is not trusted keeps its first cause; a trusted one does not begin anew.
      if (t.to == mode_ && (!pose_trusted() || t.when == reason_)) continue;
      enter(t.to, t.when);
      break;
    }
  }
  if (mode_ == Mode::enabling && in.offboard) enter(Mode::enabling, Reason::autopilot_follows);
  if (mode_ == Mode::land && before != Mode::land && in.battery_low) battery_landed_ = true;
  was_armed_ = in.armed;
  return output(in);
}

SupervisorOutput Supervisor::output(const SupervisorInput& in) noexcept {
  SupervisorOutput out;
  out.mode = mode_;
  out.reason = reason_;
  out.changed = changed_;
  changed_ = false;
  out.freeze = mode_ == Mode::hold && !pose_trusted();
  out.send_setpoint = contains(kFollowed, mode_) || (mode_ == Mode::enabling && in.frames_aligned) ||
                      (mode_ == Mode::lifting && !in.lifts_itself);
  // A vehicle found armed belongs to somebody else until an operator enables us: then nothing is commanded (row 36).
  out.send_heartbeat = contains(kCommanding, mode_) || (mode_ == Mode::passive && !in.armed);
  out.request_offboard = mode_ == Mode::enabling && in.frames_aligned && !in.offboard &&
                         seconds_in_mode() > kStreamBefore && ticks_in_mode_ % 25 == 0;
  // Never again once the autopilot has left offboard: it lands, or a pilot has taken over.
  out.request_land = mode_ == Mode::land && ticks_in_mode_ < kLandTicks && ticks_in_mode_ % 5 == 0 && in.offboard;
  return out;
}

}  // namespace backwash::track
