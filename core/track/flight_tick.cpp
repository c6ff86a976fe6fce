// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/flight_tick.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/types/time.hpp"

namespace backwash::track {
namespace {

constexpr int kArmingTicks = 150;  // 3 s: heartbeats come once a second
constexpr int kDisarmEvery = 25;   // ticks: one command may be lost
constexpr std::size_t kTakeoffEvery = 25;
constexpr double kLeastBelow = 0.1;  // m: a lift-off is over from so far below its height on
constexpr int kSettled = 50;  // ticks there: PX4 gives its loops their authority bit by bit, until 4 s after arming

// As the floats that go on the wire.
bool finite(const Setpoint& s) noexcept {
  return s.p_W.cast<float>().allFinite() && s.v_W.cast<float>().allFinite() && s.a_W.cast<float>().allFinite() &&
         std::isfinite(s.yaw);
}

}  // namespace

FlightTick::FlightTick(const Vehicle& vehicle, double battery_land, const OdometryTiming& timing, const DriftLaw& law)
    : battery_land_(battery_land),
      sigma_(vehicle.estimation.position),
      timing_(timing),
      gate_(vehicle, timing, law),
      alignment_(timing),
      supervisor_(timing),
      tracker_(Setpoint{}, vehicle) {}

// Since the newest good sample was taken, as far as the sets are to know it: of the usual timing it is in the vehicle
// file's first set (docs/model.md 4-13).
double FlightTick::sample_age(std::int64_t now_ns) const noexcept {
  return timing_.usual() ? 0 : seconds(now_ns - *last_good_ns_) + timing_.latency;
}

void FlightTick::take_segment(const TickInput& in, TickOutput& out) noexcept {
  if (!in.segment) return;
  // What was planned before an operator's order, or before the mode last ended it, is not flown (docs/faults.md row
  // 39). Nor is anything while the cause of a hold lasts: braked on its own stops it would creep on in that hold.
  const bool lasts = frames_apart(in) || Supervisor::silent(in.autopilot.pose_age(in.now_ns));
  const bool following = mode() == Mode::tracking || (mode() == Mode::hold && !in.segment->arms && !lasts);
  out.accepted = following && closure_refused_ == closures_ && in.segment->epoch == epoch_ && gate_.last() &&
                 tracker_.accept(*in.segment, gate_.last()->state, in.segment->arms ? 0 : sample_age(in.now_ns));
  if (out.accepted) verdict_ = {};
  out.refused = !out.accepted;
  out.released[0] = out.accepted ? std::exchange(segment_, in.segment) : in.segment;
}

// The set predicted for this tick against the position measured for it; what was found holds until the next sample.
void FlightTick::judge(const TickInput& in, TickOutput& out) noexcept {
  const bool on_sets = mode() == Mode::tracking || (mode() == Mode::hold && tracker_.braking());
  if (mode() == Mode::lifting && out.fresh) verdict_.inside = tracker_.within(gate_.last()->state.p_W);
  if (!on_sets && mode() != Mode::lifting) verdict_ = {};
  if (!on_sets || !gate_.last()) return;
  out.judged_segment = tracker_.segment();
  out.judged_index = tracker_.index();
  if (out.fresh) verdict_ = out.inside = tracker_.judge(gate_.last()->state.p_W, sample_age(in.now_ns));
}

SupervisorInput FlightTick::facts(const TickInput& in, const TickOutput& out) noexcept {
  SupervisorInput facts;
  facts.request = in.request;
  // Forgotten in this tick: there is no pose, and no place to hold, however young the last one was.
  facts.odometry_age = gate_.last() ? odometry_age_ : std::numeric_limits<double>::infinity();
  facts.odometry_jump = out.verdict == OdometryGate::Verdict::jump;
  facts.odometry_inconsistent = out.verdict == OdometryGate::Verdict::inconsistent;
  facts.odometry_frozen = out.verdict == OdometryGate::Verdict::frozen;
  facts.odometry_disorder = disorder_ > kDisorder;
  facts.heartbeat_age = in.autopilot.heartbeat_age;
  facts.armed = in.autopilot.armed;
  facts.arming = arming_ > 0;
  facts.offboard = in.autopilot.offboard;
  facts.frames_aligned = alignment_.aligned();
  facts.frames_apart = frames_apart(in);
  facts.frames_agree = alignment_.agree(2 * apart(in));
  facts.autopilot_reset = reset_;
  facts.closure_refused = closure_refused_now_;
  facts.pose_age = in.autopilot.pose_age(in.now_ns);
  facts.mismatch = alignment_.mismatch();
  facts.inside = verdict_.inside;
  facts.new_segment = out.accepted;
  facts.takeoff = out.accepted && in.segment->arms;
  facts.lifts_itself = in.autopilot.lifts_itself;
  facts.lifted = lifted(in);
  facts.obstacle_ahead = in.surroundings.tube_blocked;
  facts.air_rougher = in.surroundings.rougher;
  facts.outside_map = in.surroundings.outside;
  facts.map_late = in.surroundings.late;
  facts.map_missing = in.surroundings.missing;
  if (in.autopilot.battery) battery_low_ = *in.autopilot.battery < battery_land_;
  facts.battery_low = battery_low_;
  facts.port_open = in.autopilot.port_open;
  facts.transmit_failed = in.autopilot.transmit_failed;
  facts.line_slow = in.autopilot.line_slow;
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
  } else if (before == Mode::lifting && now == Mode::tracking) {
    tracker_.hold_at(tracker_.at(SIZE_MAX));
    drop_segment(out);
  } else if (now != Mode::tracking && now != Mode::lifting && before != now) {
    tracker_.hold_at(command_);
    drop_segment(out);
  }
}

// The floor is where the vehicle stands disarmed, as long as it was not asked to arm: its heartbeat may tell of that a
// second late. Higher or lower by more than the two estimates explain, or on a flight, it has left it.
void FlightTick::watch_floor(const TickInput& in, const TickOutput& out) noexcept {
  left_floor_ = in.autopilot.armed && (left_floor_ || (segment_ && !segment_->arms));
  // Armed and not seen: it may be anywhere since.
  if (in.autopilot.armed && odometry_age_ > supervisor_.hold_after()) floor_.reset();
  if (!out.fresh) return;
  const double z = gate_.last()->state.p_W.z();
  if (!in.autopilot.armed && arming_ == 0 && in.autopilot.landed.value_or(false)) floor_ = z;
  const bool off = floor_ && std::abs(z - *floor_) > apart(in);
  if (in.autopilot.armed && off) left_floor_ = true;
  // In other hands it may have come back to where it stood. Its word is taken again, but no more to stop its motors.
  if (left_floor_ && !was_commanding_ && !off && in.autopilot.landed.value_or(false)) {
    left_floor_ = false;
    floor_.reset();
  }
}

// What the autopilot says of the ground is believed where the height does not contradict it; motors are stopped where
// it is known and agrees (docs/faults.md row 56).
bool FlightTick::stands(const TickInput& in) const noexcept {
  return in.autopilot.landed.value_or(false) && floor_ && !left_floor_ && odometry_age_ <= supervisor_.hold_after();
}

// In the air, as it says itself, and as high as the take-off that was accepted ends: an autopilot may
// call itself in the air a second before it leaves the ground. For a second, so that its control has come to rest.
bool FlightTick::lifted(const TickInput& in) noexcept {
  const auto* top = tracker_.last_set();
  const double below = top ? std::max(kLeastBelow, top->half_widths[kZ]) : 0;
  const bool there = mode() == Mode::lifting && top && gate_.last() && in.autopilot.armed &&
                     in.autopilot.in_air.value_or(false) &&
                     gate_.last()->state.p_W.z() > tracker_.at(SIZE_MAX).p_W.z() - below;
  settled_ = there ? settled_ + 1 : 0;
  return settled_ > kSettled;
}

// The motors start for the take-off that was asked for, in the tick that accepts it, and for nothing else. A STOP on
// the ground stops them again, unless somebody else started them; the autopilot itself refuses to disarm in the air.
void FlightTick::ask_of_motors(const TickInput& in, Mode before, TickOutput& out) noexcept {
  const bool followed = before == Mode::tracking || before == Mode::hold || before == Mode::lifting;
  const bool runs = arming_ > 0 || (followed && in.autopilot.armed);
  arming_ = in.autopilot.armed ? 0 : std::max(0, arming_ - 1);
  const auto& s = out.supervisor;
  const bool left = s.reason == Reason::operator_request || s.reason == Reason::landed;
  const bool ours = (s.mode != Mode::passive || left) && s.mode != Mode::quiet;  // neither quiet nor a pilot's
  // Motors that turn on the floor wait for the word that it stands, however late that is.
  const bool waits = abandoned_ > 0 && in.autopilot.armed && floor_ && !left_floor_ && !stands(in);
  abandoned_ = waits ? kArmingTicks : std::max(0, abandoned_ - 1);
  const bool ends = in.request == Request::stop || in.request == Request::disable ||
                    (before == Mode::lifting && s.mode == Mode::land);
  if (runs && ends) abandoned_ = kArmingTicks;
  if (out.accepted || !ours) abandoned_ = 0;
  out.arm = out.accepted && s.mode == Mode::lifting && !in.autopilot.armed;
  if (out.arm) arming_ = kArmingTicks;
  lift_ticks_ = s.mode == Mode::lifting ? lift_ticks_ + 1 : 0;
  if (lift_ticks_ > 0 && in.autopilot.lifts_itself && in.autopilot.armed && !in.autopilot.takeoff_taken &&
      lift_ticks_ % kTakeoffEvery == 2)
    out.takeoff = tracker_.at(SIZE_MAX).p_W.z() - tracker_.at(0).p_W.z();
  out.disarm = ours && abandoned_ > 0 && abandoned_ % kDisarmEvery == 0 && stands(in) && in.autopilot.armed;
}

TickOutput FlightTick::step(const TickInput& in) noexcept {
  TickOutput out;
  epoch_.order = std::max(epoch_.order, in.order);
  std::optional<OdometrySample> sample = in.odometry;
  take_closure(sample);
  take_odometry(in, sample, out);
  align(in, out.fresh);
  take_segment(in, out);
  watch_floor(in, out);
  judge(in, out);
  odometry_age_ = last_good_ns_ ? seconds(in.now_ns - *last_good_ns_) : std::numeric_limits<double>::infinity();
  const Mode before = mode();
  out.supervisor = supervisor_.step(facts(in, out));
  const auto& s = out.supervisor;
  const bool goes_on = s.mode == Mode::tracking || s.mode == Mode::lifting ||
                       (s.mode == Mode::hold && s.reason == Reason::obstacle_ahead);
  // A stop switch gives no number with its STOP, and where the vehicle holds for one already the mode stays.
  if ((s.changed && !goes_on) || in.request == Request::stop) ++epoch_.lapse;
  follow(in, before, out);
  was_commanding_ = commanding(out.supervisor.mode);
  odometry_distrusted_ =
      was_commanding_ &&
      (odometry_distrusted_ || (!supervisor_.pose_trusted() && out.supervisor.reason != Reason::frames_disagree));
  if (s.mode == Mode::lifting)
    command_ = tracker_.at(lift_ticks_);
  else
    command_ = was_commanding_ ? tracker_.step() : tracker_.held();
  out.command = command_;
  out.command_local = alignment_.to_local(command_);
  out.finite = finite(out.command_local);
  out.supervisor.send_setpoint = out.supervisor.send_setpoint && out.finite;
  out.landed = left_floor_ ? std::optional(false) : in.autopilot.landed;
  ask_of_motors(in, before, out);
  feed(in, out);
  return out;
}

}  // namespace backwash::track
