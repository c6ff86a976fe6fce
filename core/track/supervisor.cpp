// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/supervisor.hpp"

#include <algorithm>

#include "core/types/geometry.hpp"

namespace backwash::track {
namespace {

// A pose that these speak of is not to be flown by.
constexpr bool distrusts(Reason reason) noexcept {
  return reason == Reason::odometry_jump || reason == Reason::odometry_lost || reason == Reason::odometry_frozen ||
         reason == Reason::odometry_disorder || reason == Reason::odometry_inconsistent ||
         reason == Reason::frames_disagree;
}

}  // namespace

bool Supervisor::pose_trusted() const noexcept { return !distrusts(reason_); }
double Supervisor::seconds_in_mode() const noexcept { return ticks_in_mode_ * kControlPeriod; }

void Supervisor::enter(Mode mode, Reason reason) noexcept {
  if (mode == mode_ && reason == reason_) return;
  // A hold that comes to distrust the pose begins anew: its time is limited.
  if (mode != mode_ || (mode == Mode::hold && distrusts(reason) && pose_trusted())) {
    ticks_in_mode_ = 0;
    outside_ = 0;
  }
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

// Every reason whether it can matter in this mode or not: each is a comparison or two.
Occurring Supervisor::occurring(const SupervisorInput& in) const noexcept {
  Occurring now;
  note_link_and_operator(in, now);
  note_poses(in, now);
  note_flight(in, now);
  return now;
}

void Supervisor::note_link_and_operator(const SupervisorInput& in, Occurring& now) const noexcept {
  now[Reason::port_lost] = !in.port_open;                                                                  // row 17
  now[Reason::transmit_full] = in.transmit_failed;                                                         // row 20
  now[Reason::autopilot_silent] = in.heartbeat_age > kHeartbeatLost;                                       // row 21
  now[Reason::line_slow] = in.line_slow;                                                                   // row 58
  now[Reason::clock_stopped] = in.missed_periods >= kMissedQuiet;                                          // row 32
  now[Reason::deadline_missed] = in.missed_periods > 0 && missed_.front() >= period_ - 1 - kMissedWithin;  // row 32
  now[Reason::operator_request] = (in.request == Request::disable || in.request == Request::stop) &&
                                  ((mode_ == Mode::enabling && !(in.armed && in.offboard)) || !(in.armed || in.arming));
  // A disable that comes when the vehicle may have left the ground.
  now[Reason::stop_requested] = in.request == Request::stop || in.request == Request::disable;
  now[Reason::land_requested] = in.request == Request::land;
  now[Reason::autopilot_follows] = in.offboard && in.frames_aligned;
  now[Reason::enable_timeout] = seconds_in_mode() > kEnableTimeout;
  // Rows 22 and 25; while enabling, of one that followed already and waited for the frames to agree.
  now[Reason::offboard_left] = !in.offboard && (mode_ != Mode::enabling || reason_ == Reason::autopilot_follows);
  now[Reason::disarmed] = was_armed_ && !in.armed;  // row 23
  now[Reason::not_armed] = !in.armed && !in.arming;
  now[Reason::landed] = !in.armed && !in.arming;
  now[Reason::battery_low] = in.battery_low && !battery_landed_;  // row 24
}

void Supervisor::note_poses(const SupervisorInput& in, Occurring& now) const noexcept {
  now[Reason::odometry_jump] = in.odometry_jump;                  // row 3
  now[Reason::odometry_inconsistent] = in.odometry_inconsistent;  // row 41
  now[Reason::odometry_frozen] = in.odometry_frozen;              // row 6
  now[Reason::odometry_disorder] = in.odometry_disorder;          // row 5
  now[Reason::odometry_lost] = in.odometry_age > hold_after();    // rows 1, 2
  now[Reason::pose_untrusted] =
      in.odometry_age > kLandAfter + longer_gap_ || (!pose_trusted() && seconds_in_mode() > kUntrusted);
  now[Reason::pose_silent] = silent(in.pose_age);  // row 42
  now[Reason::pose_lost] = in.pose_age > kPoseLost - kControlPeriod / 2;
  now[Reason::closure_refused] = in.closure_refused;
  now[Reason::autopilot_reset] = in.autopilot_reset;  // row 8
  now[Reason::frames_disagree] = !in.frames_agree;
  now[Reason::frames_apart] = in.frames_apart;
  now[Reason::frame_mismatch_x] = in.mismatch == Mismatch::x;  // row 7, with those below
  now[Reason::frame_mismatch_y] = in.mismatch == Mismatch::y;
  now[Reason::frame_mismatch_z] = in.mismatch == Mismatch::z;
  now[Reason::frame_mismatch_yaw] = in.mismatch == Mismatch::yaw;
  now[Reason::frame_mismatch_roll] = in.mismatch == Mismatch::roll;
  now[Reason::frame_mismatch_pitch] = in.mismatch == Mismatch::pitch;
}

void Supervisor::note_flight(const SupervisorInput& in, Occurring& now) const noexcept {
  now[Reason::map_missing] = in.map_missing;
  now[Reason::outside_map] = in.outside_map;                                           // row 9
  now[Reason::map_late] = in.map_late;                                                 // row 13
  now[Reason::obstacle_ahead] = in.obstacle_ahead;                                     // row 14
  now[Reason::air_rougher] = in.air_rougher;                                           // row 54
  now[Reason::outside_set] = now[Reason::outside_column] = outside_ >= kOutsideTicks;  // row 16
  now[Reason::takeoff_accepted] = in.new_segment && in.takeoff;
  now[Reason::segment_accepted] = in.new_segment && pose_trusted() && !in.frames_apart;
  now[Reason::lifted_off] = in.lifted;
  now[Reason::lift_timeout] = seconds_in_mode() > kLiftTimeout;
  now[Reason::land_sent] = reason_ == Reason::pose_untrusted && ticks_in_mode_ >= kLandTicks;
}

SupervisorOutput Supervisor::step(const SupervisorInput& in) noexcept {
  count(in);
  const Mode before = mode_;
  const bool again = in.request == Request::land || in.request == Request::stop;
  if (mode_ == Mode::land && again && reason_ != Reason::pose_untrusted) ticks_in_mode_ = 0;
  const Occurring occurs = occurring(in);
  if (!commanding(mode_)) {
    if (in.request == Request::enable) {
      const auto why = std::ranges::find_if(refusals(), [&](Reason r) { return occurs[r]; });
      if (why == refusals().end())
        enter(Mode::enabling, Reason::enabled);
      else
        enter(mode_, *why);
    } else if (again && in.armed && in.offboard && in.port_open && in.heartbeat_age <= kHeartbeatLost) {
      // Nobody else has it in hand: there is nothing to stop on, and no stop is refused (row 36).
      enter(Mode::land, in.request == Request::land ? Reason::land_requested : Reason::stop_requested);
    }
  } else {
    for (const Transition& t : transitions()) {
      if (!contains(t.from, mode_) || !occurs[t.when]) continue;
      // A hold on a pose that is not trusted keeps its first cause; a trusted one does not begin anew, and a line that
      // stays slow takes no other's place.
      if (t.to == mode_ && (!pose_trusted() || t.when == reason_ || t.when == Reason::line_slow)) continue;
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
  out.send_heartbeat = commanding(mode_) || (mode_ == Mode::passive && !in.armed);
  out.request_offboard = mode_ == Mode::enabling && in.frames_aligned && !in.offboard &&
                         seconds_in_mode() > kStreamBefore && ticks_in_mode_ % 25 == 0;
  // Never again once the autopilot has left offboard: it lands, or a pilot has taken over.
  out.request_land = mode_ == Mode::land && ticks_in_mode_ < kLandTicks && ticks_in_mode_ % 5 == 0 && in.offboard;
  return out;
}

}  // namespace backwash::track
