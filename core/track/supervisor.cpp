// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/supervisor.hpp"

#include "core/types/geometry.hpp"

namespace backwash::track {
namespace {

// LAND is repeated for this many ticks (one command may be lost), then the daemon goes quiet.
constexpr int kLandTicks = 10;

double seconds(int ticks) noexcept { return ticks * kControlPeriod; }

}  // namespace

const char* to_string(Mode mode) noexcept {
  switch (mode) {
    case Mode::passive:
      return "passive";
    case Mode::enabling:
      return "enabling";
    case Mode::tracking:
      return "tracking";
    case Mode::hold:
      return "hold";
    case Mode::land:
      return "land";
    case Mode::quiet:
      return "quiet";
  }
  return "?";
}

const char* to_string(Reason reason) noexcept {
  switch (reason) {
    case Reason::started:
      return "started";
    case Reason::enabled:
      return "enable requested";
    case Reason::operator_request:
      return "operator request";
    case Reason::autopilot_follows:
      return "autopilot follows our set-points";
    case Reason::segment_accepted:
      return "new trajectory accepted";
    case Reason::enable_timeout:
      return "autopilot did not follow within 5 s";
    case Reason::odometry_lost:
      return "odometry lost";
    case Reason::odometry_jump:
      return "odometry jumped";
    case Reason::frames_disagree:
      return "map and autopilot frames disagree";
    case Reason::outside_set:
      return "error outside its reachable set for 3 ticks";
    case Reason::deadline_missed:
      return "control deadline missed";
    case Reason::port_lost:
      return "port to the autopilot lost";
    case Reason::transmit_full:
      return "port to the autopilot does not take set-points";
    case Reason::autopilot_silent:
      return "no heartbeat from the autopilot for 1.5 s";
    case Reason::offboard_left:
      return "autopilot left offboard";
    case Reason::disarmed:
      return "disarmed";
    case Reason::landed:
      return "landed";
    case Reason::land_sent:
      return "land requested of the autopilot";
  }
  return "?";
}

void Supervisor::enter(Mode mode, Reason reason) noexcept {
  if (mode == mode_ && reason == reason_) return;
  if (mode != mode_) ticks_in_mode_ = 0, outside_ = 0;
  mode_ = mode;
  reason_ = reason;
  changed_ = true;
}

// Rows 17, 20, 21 and 32: without a working link or a working clock nothing may be streamed.
bool Supervisor::link_faults(const SupervisorInput& in) noexcept {
  if (!in.port_open) return enter(Mode::quiet, Reason::port_lost), true;
  if (in.transmit_failed) return enter(Mode::quiet, Reason::transmit_full), true;
  if (in.heartbeat_age > kHeartbeatLost) return enter(Mode::quiet, Reason::autopilot_silent), true;
  if (in.missed_periods >= kMissedQuiet) return enter(Mode::quiet, Reason::deadline_missed), true;
  return false;
}

void Supervisor::enabling(const SupervisorInput& in) noexcept {
  if (in.request == Request::disable) return enter(Mode::passive, Reason::operator_request);
  if (in.odometry_age > kHoldAfter) return enter(Mode::passive, Reason::odometry_lost);
  if (in.offboard && in.frames_aligned) {
    was_armed_ = in.armed;
    return enter(Mode::tracking, Reason::autopilot_follows);
  }
  if (seconds(ticks_in_mode_) > kEnableTimeout)
    enter(Mode::passive, in.frames_aligned ? Reason::enable_timeout : Reason::frames_disagree);
}

void Supervisor::tracking(const SupervisorInput& in) noexcept {
  if (!in.offboard) return enter(Mode::passive, Reason::offboard_left);        // row 22
  if (was_armed_ && !in.armed) return enter(Mode::passive, Reason::disarmed);  // row 23
  was_armed_ = in.armed;
  if (in.request == Request::land) return enter(Mode::land, Reason::operator_request);
  if (in.request == Request::disable && !in.armed) return enter(Mode::passive, Reason::operator_request);
  if (in.odometry_jump) return enter(Mode::hold, Reason::odometry_jump);              // row 3
  if (in.odometry_age > kHoldAfter) return enter(Mode::hold, Reason::odometry_lost);  // rows 1, 2, 5
  if (!in.frames_aligned) return enter(Mode::hold, Reason::frames_disagree);          // row 8
  outside_ = in.inside ? 0 : outside_ + 1;
  if (outside_ >= kOutsideTicks) enter(Mode::hold, Reason::outside_set);  // row 16
}

void Supervisor::holding(const SupervisorInput& in) noexcept {
  if (!in.offboard) return enter(Mode::passive, Reason::offboard_left);
  if (was_armed_ && !in.armed) return enter(Mode::passive, Reason::disarmed);
  if (in.request == Request::land) return enter(Mode::land, Reason::operator_request);
  if (in.request == Request::disable && !in.armed) return enter(Mode::passive, Reason::operator_request);
  if (in.odometry_age > kLandAfter) return enter(Mode::land, Reason::odometry_lost);
  // A pose that is not trusted may be held for 400 ms at most, however the samples look.
  const bool untrusted =
      reason_ == Reason::odometry_jump || reason_ == Reason::odometry_lost || reason_ == Reason::frames_disagree;
  if (untrusted && seconds(ticks_in_mode_) > kLandAfter - kHoldAfter) return enter(Mode::land, reason_);
  if (in.new_segment && !untrusted) enter(Mode::tracking, Reason::segment_accepted);
}

void Supervisor::landing(const SupervisorInput& in) noexcept {
  if (was_armed_ && !in.armed) return enter(Mode::passive, Reason::landed);
  const bool pose_lost = reason_ != Reason::operator_request;
  if (pose_lost && ticks_in_mode_ >= kLandTicks) enter(Mode::quiet, Reason::land_sent);
}

SupervisorOutput Supervisor::step(const SupervisorInput& in) noexcept {
  ++ticks_in_mode_;
  const bool commanding =
      mode_ == Mode::enabling || mode_ == Mode::tracking || mode_ == Mode::hold || mode_ == Mode::land;
  if (!commanding) {
    if (in.request == Request::enable && in.port_open && in.heartbeat_age <= kHeartbeatLost &&
        in.odometry_age <= kHoldAfter)
      enter(Mode::enabling, Reason::enabled);
  } else if (!link_faults(in)) {
    switch (mode_) {
      case Mode::enabling:
        enabling(in);
        break;
      case Mode::tracking:
        tracking(in);
        break;
      case Mode::hold:
        holding(in);
        break;
      default:
        landing(in);
        break;
    }
  }
  SupervisorOutput out;
  out.mode = mode_;
  out.reason = reason_;
  out.changed = changed_;
  changed_ = false;
  out.freeze = mode_ == Mode::hold;
  out.send_setpoint = mode_ == Mode::tracking || mode_ == Mode::hold || (mode_ == Mode::enabling && in.frames_aligned);
  // A vehicle found armed belongs to somebody else until an operator enables us: then nothing at all is sent (row 36).
  const bool bystander = mode_ == Mode::passive && !in.armed;
  out.send_heartbeat =
      mode_ == Mode::enabling || mode_ == Mode::tracking || mode_ == Mode::hold || mode_ == Mode::land || bystander;
  out.forward_odometry = out.send_heartbeat;
  out.request_offboard = mode_ == Mode::enabling && in.frames_aligned && !in.offboard &&
                         seconds(ticks_in_mode_) > kStreamBefore && ticks_in_mode_ % 25 == 0;
  out.request_land = mode_ == Mode::land && ticks_in_mode_ < kLandTicks && ticks_in_mode_ % 5 == 0;
  return out;
}

}  // namespace backwash::track
