// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/flight_tick.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

namespace backwash::track {
namespace {

constexpr int kArmingTicks = 150;  // 3 s: heartbeats come once a second
constexpr int kDisarmEvery = 25;   // ticks: one command may be lost
constexpr int kDisorder = 3;       // more in a row are as no odometry at all (faults.md row 5)

double seconds(std::int64_t ns) noexcept { return static_cast<double>(ns) * 1e-9; }

FramePose pose_of(const State& state, const std::array<double, 4>& wxyz) noexcept {
  const Eigen::Quaterniond q(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  const double yaw = std::atan2(2 * (q.w() * q.z() + q.x() * q.y()), 1 - 2 * (q.y() * q.y() + q.z() * q.z()));
  return {state.p_W, yaw, state.v_W, q.conjugate() * Vec3::UnitZ()};
}

bool commanding(Mode mode) noexcept {
  return mode == Mode::enabling || mode == Mode::tracking || mode == Mode::hold || mode == Mode::land;
}

bool finite(const Setpoint& s) noexcept {
  return s.p_W.allFinite() && s.v_W.allFinite() && s.a_W.allFinite() && std::isfinite(s.yaw);
}

}  // namespace

FlightTick::FlightTick(const Vehicle& vehicle, double battery_land)
    : battery_land_(battery_land), gate_(vehicle), tracker_(Setpoint{}, vehicle) {}

// A loop closure (faults.md row 4) moves the map frame under the vehicle. Everything that is in it moves along within
// this tick, so that in the controller's frame, and physically, nothing has moved; the planner then brings the flight
// back to its place in the map (rectified()).
void FlightTick::take_closure(const TickInput& in) noexcept {
  if (!in.odometry || in.odometry->closures == closures_) return;
  const RigidShift D = in.odometry->map_from_odom * map_from_odom_.inverse();
  const bool first = closures_ == 0;
  closures_ = in.odometry->closures;
  map_from_odom_ = in.odometry->map_from_odom;
  if (first) return tracker_.rebase({}, closures_);  // until now nothing was in the map by way of it
  gate_.rebase(D);
  alignment_.rebase(D);
  tracker_.rebase(D, closures_);
  command_ = D.setpoint(command_);
}

void FlightTick::take_odometry(const TickInput& in, TickOutput& out) noexcept {
  if (!in.odometry) return;
  // After a jump or a gap a sample that looks good again may still be in another place: it is not believed, and not
  // forwarded, until the vehicle is in other hands.
  if (odometry_distrusted_) {
    out.verdict = OdometryGate::Verdict::rejected;
    return;
  }
  const bool moving = command_.v_W.norm() > 0.05;
  out.verdict = gate_.take(*in.odometry, moving);
  disorder_ = out.verdict == OdometryGate::Verdict::disorder ? std::min(disorder_ + 1, kDisorder + 1) : 0;
  if (out.verdict == OdometryGate::Verdict::good) {
    last_good_ns_ = std::min(in.odometry->received_ns, in.now_ns);
    out.fresh = true;
  }
  if (out.verdict == OdometryGate::Verdict::jump && !was_commanding_) gate_.forget();
}

// Learns local ← map while nothing is commanded, watches it otherwise; takes it anew when the controller's estimator
// was reset. The odometry is brought to the moment at which the controller's position arrived.
void FlightTick::align(const TickInput& in, bool fresh) noexcept {
  reset_ = false;
  if (!in.autopilot.pose || !gate_.last() || !fresh || in.autopilot.pose->at_ns == last_pose_ns_) return;
  last_pose_ns_ = in.autopilot.pose->at_ns;
  OdometrySample odometry = *gate_.last();
  odometry.state.p_W += seconds(in.now_ns - odometry.received_ns) * odometry.state.v_W;
  const FramePose in_map = pose_of(odometry.state, odometry.q);
  const FramePose in_local = pose_of(in.autopilot.pose->state, in.autopilot.pose->q);
  const bool counted = reset_counter_ && in.autopilot.reset_counter && *reset_counter_ != *in.autopilot.reset_counter;
  if (in.autopilot.reset_counter) reset_counter_ = in.autopilot.reset_counter;
  const bool may_move = mode() != Mode::land && !(mode() == Mode::hold && !supervisor_.pose_trusted());
  if (may_move && (counted || alignment_.reset_between(in_map, in_local))) {
    alignment_.rebase(in_map, in_local);
    reset_ = was_commanding_;
  }
  alignment_.update(in_map, in_local, !was_commanding_);
}

void FlightTick::take_segment(const TickInput& in, TickOutput& out) noexcept {
  if (!in.segment) return;
  // What was planned before an operator's order, or before the mode last ended it, is not flown (faults.md row 39).
  const bool following = mode() == Mode::tracking || mode() == Mode::hold;
  out.accepted =
      following && in.segment->epoch == epoch_ && gate_.last() && tracker_.accept(*in.segment, gate_.last()->state);
  out.refused = !out.accepted;
  out.released[0] = out.accepted ? std::exchange(segment_, in.segment) : in.segment;
}

// The set predicted for this tick against the position measured for it.
void FlightTick::judge(TickOutput& out) noexcept {
  const bool on_sets = mode() == Mode::tracking || (mode() == Mode::hold && tracker_.braking());
  if (!on_sets || !gate_.last()) return;
  out.judged_segment = tracker_.segment();
  out.judged_index = tracker_.index();
  if (out.fresh) out.inside = tracker_.judge(gate_.last()->state.p_W);
}

SupervisorInput FlightTick::facts(const TickInput& in, const TickOutput& out) const noexcept {
  SupervisorInput facts;
  facts.request = in.request;
  facts.odometry_age = odometry_age_;
  facts.odometry_jump = out.verdict == OdometryGate::Verdict::jump;
  facts.odometry_frozen = out.verdict == OdometryGate::Verdict::frozen;
  facts.odometry_disorder = disorder_ > kDisorder;
  facts.heartbeat_age = in.autopilot.heartbeat_age;
  facts.armed = in.autopilot.armed;
  facts.arming = arming_ > 0;
  facts.offboard = in.autopilot.offboard;
  facts.frames_aligned = alignment_.aligned();
  facts.autopilot_reset = reset_;
  facts.mismatch = alignment_.mismatch();
  facts.inside = out.inside.inside;
  facts.new_segment = out.accepted;
  facts.obstacle_ahead = in.surroundings.tube_blocked;
  facts.outside_map = in.surroundings.outside;
  facts.map_late = in.surroundings.late;
  facts.map_missing = in.surroundings.missing;
  facts.battery_low = in.autopilot.battery && *in.autopilot.battery < battery_land_;
  facts.port_open = in.autopilot.port_open;
  facts.transmit_failed = in.autopilot.transmit_failed;
  facts.missed_periods = in.missed_periods;
  return facts;
}

void FlightTick::drop_segment(TickOutput& out) noexcept {
  if (const auto* dropped = std::exchange(segment_, nullptr)) out.released[out.released[0] ? 1 : 0] = dropped;
}

// What the tracker does on the way into a mode.
void FlightTick::follow(const TickInput& in, Mode before, TickOutput& out) noexcept {
  const Mode now = out.supervisor.mode;
  if (now == Mode::enabling && before != Mode::enabling && gate_.last()) {
    // A new start: hold where the vehicle is now.
    const FramePose here = pose_of(gate_.last()->state, gate_.last()->q);
    tracker_.hold_at({here.p, Vec3::Zero(), Vec3::Zero(), here.yaw});
    drop_segment(out);
  } else if (now == Mode::hold) {
    // With a trusted pose to rest on a verified stop, unless something stands in its way or there is none.
    const bool starts = before != Mode::hold;
    const bool blocked = tracker_.braking() ? in.surroundings.tube_blocked : in.surroundings.stop_blocked;
    const bool brakes = starts || out.accepted;  // a segment that was taken in the tick of its end
    const bool rolls = !out.supervisor.freeze && !blocked && (brakes ? tracker_.brake() : tracker_.braking());
    if (!rolls && (brakes || tracker_.braking() || out.supervisor.changed)) {
      tracker_.hold_at(command_);
      drop_segment(out);
    }
  } else if (now != Mode::tracking && before != now) {
    tracker_.hold_at(command_);
    drop_segment(out);
  }
}

// The motors start for the take-off that was asked for, in the tick that accepts it, and for nothing else. A STOP on
// the ground stops them again; the autopilot itself refuses to disarm in the air.
void FlightTick::ask_of_motors(const TickInput& in, TickOutput& out) noexcept {
  const bool stands = in.autopilot.landed.value_or(false), runs = in.autopilot.armed || arming_ > 0;
  arming_ = std::max(0, arming_ - 1);
  abandoned_ = std::max(0, abandoned_ - 1);
  const bool ends = in.request == Request::stop || in.request == Request::disable;
  if (stands && runs && ends) abandoned_ = kArmingTicks;
  if (out.accepted) abandoned_ = 0;
  out.arm = out.accepted && in.segment->arms && out.supervisor.mode == Mode::tracking && !in.autopilot.armed;
  if (out.arm) arming_ = kArmingTicks;
  out.disarm = abandoned_ > 0 && abandoned_ % kDisarmEvery == 0 && stands && in.autopilot.armed;
}

TickOutput FlightTick::step(const TickInput& in) noexcept {
  TickOutput out;
  epoch_.order = std::max(epoch_.order, in.order);
  take_closure(in);
  take_odometry(in, out);
  align(in, out.fresh);
  take_segment(in, out);
  judge(out);
  odometry_age_ = last_good_ns_ < 0 ? std::numeric_limits<double>::infinity() : seconds(in.now_ns - last_good_ns_);
  const Mode before = mode();
  out.supervisor = supervisor_.step(facts(in, out));
  const auto& s = out.supervisor;
  if (s.changed && s.mode != Mode::tracking && s.reason != Reason::obstacle_ahead) ++epoch_.lapse;
  follow(in, before, out);
  was_commanding_ = commanding(out.supervisor.mode);
  odometry_distrusted_ =
      was_commanding_ &&
      (odometry_distrusted_ || (out.supervisor.freeze && out.supervisor.reason != Reason::frames_disagree));
  command_ = was_commanding_ ? tracker_.step() : tracker_.held();
  out.command = command_;
  out.command_local = alignment_.to_local(command_);
  out.finite = finite(out.command_local);
  out.supervisor.send_setpoint = out.supervisor.send_setpoint && out.finite;
  ask_of_motors(in, out);
  return out;
}

}  // namespace backwash::track
