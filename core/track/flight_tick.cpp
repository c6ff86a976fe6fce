// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/flight_tick.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
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

constexpr double kClosureFades = 10;  // s: closures add up for so long, or an absurd one would come in pieces
constexpr int kLeavesGround = 65;     // ticks: PX4 says 1.15 s before it leaves the ground that it is in the air

std::int64_t nanoseconds(double s) noexcept { return static_cast<std::int64_t>(s * 1e9); }

// With the heading's rate: the body's about the vertical, over the share of it that turns the heading.
FramePose local_pose(const AutopilotFacts::Pose& pose) noexcept {
  FramePose result = pose_of(pose.state, pose.q);
  const Vec3& up = result.up_B;
  result.yaw_rate =
      (pose.omega_B.y() * up.y() + pose.omega_B.z() * up.z()) / std::max(1e-3, up.tail<2>().squaredNorm());
  return result;
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

bool FlightTick::accepts(const TickInput& in) noexcept {
  if (!in.segment) return false;
  // What was planned before an operator's order, or before the mode last ended it, is not flown (docs/faults.md row
  // 39). Nor is anything while the cause of a hold lasts: braked on its own stops it would creep on in that hold.
  const bool lasts = frames_apart(in) || Supervisor::silent(in.autopilot.pose_age(in.now_ns));
  const bool following = mode() == Mode::tracking || (mode() == Mode::hold && !in.segment->arms && !lasts);
  const bool accepted = following && closure_refused_ == closures_ && in.segment->epoch == epoch_ && gate_.last() &&
                        tracker_.accept(*in.segment, gate_.last()->state, in.segment->arms ? 0 : sample_age(in.now_ns));
  if (accepted) verdict_ = {};
  return accepted;
}

// The set predicted for this tick against the position measured for it; what was found holds until the next sample.
FlightTick::Judged FlightTick::judge(const TickInput& in, bool fresh) noexcept {
  const bool on_sets = mode() == Mode::tracking || (mode() == Mode::hold && tracker_.braking());
  if (mode() == Mode::lifting && fresh) verdict_.inside = tracker_.within(gate_.last()->state.p_W);
  if (!on_sets && mode() != Mode::lifting) verdict_ = {};
  if (!on_sets || !gate_.last()) return {};
  if (fresh) verdict_ = tracker_.judge(gate_.last()->state.p_W, sample_age(in.now_ns));
  return {fresh ? verdict_ : Inside{}, tracker_.segment(), tracker_.index()};
}

SupervisorInput FlightTick::facts(const TickInput& in, OdometryGate::Verdict verdict, bool accepted) noexcept {
  if (in.autopilot.battery) battery_low_ = *in.autopilot.battery < battery_land_;
  return {.request = in.request,
          // Forgotten in this tick: there is no pose, and no place to hold, however young the last one was.
          .odometry_age = gate_.last() ? odometry_age_ : std::numeric_limits<double>::infinity(),
          .odometry_jump = verdict == OdometryGate::Verdict::jump,
          .odometry_inconsistent = verdict == OdometryGate::Verdict::inconsistent,
          .odometry_frozen = verdict == OdometryGate::Verdict::frozen,
          .odometry_disorder = disorder_ > kDisorder,
          .heartbeat_age = in.autopilot.heartbeat_age,
          .pose_age = in.autopilot.pose_age(in.now_ns),
          .armed = in.autopilot.armed,
          .arming = arming_ > 0,
          .lifts_itself = in.autopilot.lifts_itself,
          .lifted = lifted(in),
          .offboard = in.autopilot.offboard,
          .frames_aligned = alignment_.aligned(),
          .frames_apart = frames_apart(in),
          .frames_agree = alignment_.agree(2 * apart(in)),
          .autopilot_reset = reset_,
          .closure_refused = closure_refused_now_,
          .mismatch = alignment_.mismatch(),
          .inside = verdict_.inside,
          .new_segment = accepted,
          .takeoff = accepted && in.segment->arms,
          .obstacle_ahead = in.surroundings.tube_blocked,
          .air_rougher = in.surroundings.rougher,
          .outside_map = in.surroundings.outside,
          .map_late = in.surroundings.late,
          .map_missing = in.surroundings.missing,
          .battery_low = battery_low_,
          .port_open = in.autopilot.port_open,
          .transmit_failed = in.autopilot.transmit_failed,
          .line_slow = in.autopilot.line_slow,
          .missed_periods = in.missed_periods};
}

// What the tracker does on the way into a mode.
bool FlightTick::follow(const TickInput& in, Mode before, bool accepted, const SupervisorOutput& reaction) noexcept {
  const Mode now = reaction.mode;
  if (now == Mode::enabling && before != Mode::enabling && gate_.last()) {
    // A new start: hold where the vehicle is now.
    const FramePose here = pose_of(gate_.last()->state, gate_.last()->q);
    tracker_.hold_at({here.p, Vec3::Zero(), Vec3::Zero(), here.yaw});
  } else if (now == Mode::hold) {
    // With a trusted pose to rest on a verified stop, unless something stands in its way or there is none.
    const bool starts = before != Mode::hold;
    const bool blocked = tracker_.braking() ? in.surroundings.tube_blocked : in.surroundings.stop_blocked;
    const bool brakes = starts || accepted;  // a segment that was taken in the tick of its end
    const bool rolls = !reaction.freeze && !blocked && (brakes ? tracker_.brake() : tracker_.braking());
    if (rolls || !(brakes || tracker_.braking() || reaction.changed)) return true;
    tracker_.hold_at(command_);
  } else if (before == Mode::lifting && now == Mode::tracking) {
    tracker_.hold_at(tracker_.at(SIZE_MAX));
  } else if (now != Mode::tracking && now != Mode::lifting && before != now) {
    tracker_.hold_at(command_);
  } else {
    return true;
  }
  return false;
}

// A stop switch gives no number with its STOP, and where the vehicle holds for one already the mode stays.
void FlightTick::remember(const TickInput& in, const SupervisorOutput& reaction) noexcept {
  const Mode now = reaction.mode;
  const bool goes_on =
      now == Mode::tracking || now == Mode::lifting || (now == Mode::hold && reaction.reason == Reason::obstacle_ahead);
  if ((reaction.changed && !goes_on) || in.request == Request::stop) ++epoch_.lapse;
  was_commanding_ = commanding(now);
  const bool fault = !supervisor_.pose_trusted() && reaction.reason != Reason::frames_disagree;
  odometry_distrusted_ = was_commanding_ && (odometry_distrusted_ || fault);
}

Setpoint FlightTick::commanded(Mode now) noexcept {
  if (now == Mode::lifting) return tracker_.at(lift_ticks_);
  return was_commanding_ ? tracker_.step() : tracker_.held();
}

// The floor is where the vehicle stands disarmed, as long as it was not asked to arm: its heartbeat may tell of that a
// second late. Higher or lower by more than the two estimates explain, or on a flight, it has left it.
void FlightTick::watch_floor(const TickInput& in, bool fresh) noexcept {
  left_floor_ = in.autopilot.armed && (left_floor_ || (segment_ && !segment_->arms));
  // Armed and not seen: it may be anywhere since.
  if (in.autopilot.armed && odometry_age_ > supervisor_.hold_after()) floor_.reset();
  if (!fresh) return;
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
FlightTick::Motors FlightTick::ask_of_motors(const TickInput& in, Mode before, bool accepted,
                                             const SupervisorOutput& s) noexcept {
  const bool followed = before == Mode::tracking || before == Mode::hold || before == Mode::lifting;
  const bool runs = arming_ > 0 || (followed && in.autopilot.armed);
  arming_ = in.autopilot.armed ? 0 : std::max(0, arming_ - 1);
  const bool left = s.reason == Reason::operator_request || s.reason == Reason::landed;
  const bool ours = (s.mode != Mode::passive || left) && s.mode != Mode::quiet;  // neither quiet nor a pilot's
  // Motors that turn on the floor wait for the word that it stands, however late that is.
  const bool waits = abandoned_ > 0 && in.autopilot.armed && floor_ && !left_floor_ && !stands(in);
  abandoned_ = waits ? kArmingTicks : std::max(0, abandoned_ - 1);
  const bool ends = in.request == Request::stop || in.request == Request::disable ||
                    (before == Mode::lifting && s.mode == Mode::land);
  if (runs && ends) abandoned_ = kArmingTicks;
  if (accepted || !ours) abandoned_ = 0;
  Motors out;
  out.arm = accepted && s.mode == Mode::lifting && !in.autopilot.armed;
  if (out.arm) arming_ = kArmingTicks;
  lift_ticks_ = s.mode == Mode::lifting ? lift_ticks_ + 1 : 0;
  if (lift_ticks_ > 0 && in.autopilot.lifts_itself && in.autopilot.armed && !in.autopilot.takeoff_taken &&
      lift_ticks_ % kTakeoffEvery == 2)
    out.takeoff = tracker_.at(SIZE_MAX).p_W.z() - tracker_.at(0).p_W.z();
  out.disarm = ours && abandoned_ > 0 && abandoned_ % kDisarmEvery == 0 && stands(in) && in.autopilot.armed;
  return out;
}

TickOutput FlightTick::step(const TickInput& in) noexcept {
  epoch_.order = std::max(epoch_.order, in.order);
  const std::optional<OdometrySample> sample = in_frame_flown(in.odometry);
  const Odometry odometry = believed(in, sample);
  align(in, odometry.fresh);
  const bool accepted = accepts(in);
  const AcceptedSegment* const replaced = accepted ? std::exchange(segment_, in.segment) : in.segment;
  watch_floor(in, odometry.fresh);
  const Judged judged = judge(in, odometry.fresh);
  odometry_age_ = last_good_ns_ ? seconds(in.now_ns - *last_good_ns_) : std::numeric_limits<double>::infinity();
  const Mode before = mode();
  SupervisorOutput reaction = supervisor_.step(facts(in, odometry.verdict, accepted));
  const bool goes_on = follow(in, before, accepted, reaction);
  const AcceptedSegment* const dropped = goes_on ? nullptr : std::exchange(segment_, nullptr);
  remember(in, reaction);
  command_ = commanded(reaction.mode);
  const Setpoint local = alignment_.to_local(command_);
  const bool sendable = finite(local);
  reaction.send_setpoint = reaction.send_setpoint && sendable;
  const Motors motors = ask_of_motors(in, before, accepted, reaction);
  return {.supervisor = reaction,
          .command = command_,
          .command_local = local,
          .finite = sendable,
          .verdict = odometry.verdict,
          .fresh = odometry.fresh,
          .arm = motors.arm,
          .disarm = motors.disarm,
          .landed = left_floor_ ? std::optional(false) : in.autopilot.landed,
          .takeoff = motors.takeoff,
          .forward_odometry = feeds(in, odometry.fresh, reaction.mode),
          .odometry_resets = odometry_resets_,
          .inside = judged.inside,
          .judged_segment = judged.segment,
          .judged_index = judged.index,
          .accepted = accepted,
          .refused = in.segment && !accepted,
          .released = {replaced ? replaced : dropped, replaced ? dropped : nullptr}};
}

// What a tick believes of poses: loop closures, odometry, and the controller's frame against the map's.

FramePose pose_of(const State& state, const std::array<double, 4>& q) noexcept {
  return {state.p_W, heading(q), state.v_W, up_in_body(q)};
}

double AutopilotFacts::pose_age(std::int64_t now_ns) const noexcept {
  return pose ? seconds(now_ns - std::min(pose->at_ns, pose->attitude_at_ns)) : std::numeric_limits<double>::infinity();
}

// A loop closure (docs/faults.md row 4) moves the map frame under the vehicle. Everything that is in it moves along
// within this tick, so that in the controller's frame, and physically, nothing has moved; the planner then brings the
// flight back to its place in the map (rectified()). One that is absurd is not flown: the samples are brought back into
// the frame that is flown in, until the vehicle is in other hands.
std::optional<OdometrySample> FlightTick::in_frame_flown(std::optional<OdometrySample> sample) noexcept {
  closure_refused_now_ = false;
  const double faded = was_commanding_ ? 1 - kControlPeriod / kClosureFades : 0;
  closed_m_ *= faded, closed_rad_ *= faded;
  if (!sample || sample->closures == closures_) return sample;
  const RigidShift D = sample->map_from_odom * map_from_odom_.inverse();
  const bool first = closures_ == 0;
  const OdometrySample before = moved(D.inverse(), *sample);
  // Written so that what is no number is refused.
  const double by = (sample->state.p_W - before.state.p_W).norm(), turn = std::abs(D.yaw);
  const bool small = closed_m_ + by <= kMaxClosure && closed_rad_ + turn <= kMaxClosureTurn;
  if (was_commanding_ && small) closed_m_ += by, closed_rad_ += turn;
  if (was_commanding_ && !small) {
    closure_refused_now_ = closure_refused_ != sample->closures;
    closure_refused_ = sample->closures;
    sample = before;
    sample->closures = closures_;
    sample->map_from_odom = map_from_odom_;
    return sample;
  }
  closure_refused_ = closures_ = sample->closures;
  map_from_odom_ = sample->map_from_odom;
  if (first) {  // until now nothing was in the map by way of it
    tracker_.rebase({}, closures_);
    return sample;
  }
  gate_.rebase(D);
  alignment_.rebase(D);
  tracker_.rebase(D, closures_);
  if (floor_) *floor_ += D.t.z();
  command_ = D.setpoint(command_);
  return sample;
}

FlightTick::Odometry FlightTick::believed(const TickInput& in, const std::optional<OdometrySample>& sample) noexcept {
  if (!sample) return {};
  // After a jump or a gap a sample that looks good again may still be in another place: it is not believed, and not
  // forwarded, until the vehicle is in other hands.
  if (odometry_distrusted_) return {.verdict = OdometryGate::Verdict::rejected};
  using Verdict = OdometryGate::Verdict;
  // A pose that repeats to the last bit is frozen in the air even if nothing is to move; standing, it may be still.
  const bool flies = in.autopilot.armed && (left_floor_ || in.autopilot.landed == false);
  const bool lifts = mode() == Mode::lifting;
  off_ground_ = lifts && flies ? off_ground_ + 1 : 0;
  const bool moving = lifts ? off_ground_ > kLeavesGround : command_.v_W.norm() > 0.05 || flies;
  const Verdict verdict = gate_.take(*sample, moving);
  const bool fresh = verdict == Verdict::good;
  disorder_ = verdict == Verdict::disorder ? std::min(disorder_ + 1, kDisorder + 1) : 0;
  if (fresh) last_good_ns_ = std::min(sample->received_ns, in.now_ns) - nanoseconds(gate_.late());
  const bool other = verdict == Verdict::jump || verdict == Verdict::inconsistent;
  const bool elsewhere =
      other || disorder_ > kDisorder || (fresh && seconds(in.now_ns - *last_good_ns_) > supervisor_.hold_after());
  if (elsewhere && !was_commanding_) {
    gate_.forget();
    floor_.reset();
    if (other) ++odometry_resets_;
  }
  return {verdict, fresh};
}

// Learns local ← map while nothing is commanded, watches it otherwise. Takes it anew when the controller's estimator
// was reset: by its counter, or by its own samples, which jumped while the odometry passed its gate. The odometry is
// brought to the moments of the controller's position and attitude. What is told again, its stamp by now a little
// earlier in our clock, is no new pair: as a step of no time it would end what the gyros have added up.
void FlightTick::align(const TickInput& in, bool fresh) noexcept {
  reset_ = false;
  const auto& pose = in.autopilot.pose;
  if (timing_.latency > 0 && pose) remember_tilt(*pose, up_in_body(pose->q));
  if (!pose || !gate_.last() || !fresh || pose->at_ns <= last_pose_ns_ || pose->attitude_at_ns <= last_attitude_ns_)
    return;
  const double dt = last_pose_ns_ ? seconds(pose->at_ns - *last_pose_ns_) : 0;  // the first pair ends no step
  last_pose_ns_ = pose->at_ns;
  last_attitude_ns_ = pose->attitude_at_ns;
  FramePose in_local = local_pose(*pose);
  FramePose in_map = pose_of(gate_.last()->state, gate_.last()->q);
  const std::int64_t taken_ns = *last_good_ns_ - nanoseconds(timing_.latency);
  in_map.p += seconds(pose->at_ns - taken_ns) * in_map.v;
  in_map.yaw += seconds(pose->attitude_at_ns - taken_ns) * in_local.yaw_rate;
  if (timing_.latency > 0) in_local.up_B = tilt_at(taken_ns, in_local.up_B);
  const bool counted = reset_counter_ && in.autopilot.reset_counter && *reset_counter_ != *in.autopilot.reset_counter;
  if (in.autopilot.reset_counter) reset_counter_ = in.autopilot.reset_counter;
  const bool may_move = mode() != Mode::land && !(mode() == Mode::hold && !supervisor_.pose_trusted());
  const bool jumped =
      alignment_.reset_between(in_map, in_local) && (!was_commanding_ || alignment_.local_jumped(in_local, dt));
  if (may_move && (counted || jumped)) {
    alignment_.rebase(in_map, in_local);
    reset_ = was_commanding_;
  }
  alignment_.update(in_map, in_local, dt, !was_commanding_);
}

// A tilt is not carried on, but compared where it belongs: with the autopilot's of the moment that the odometry is of.
void FlightTick::remember_tilt(const AutopilotFacts::Pose& pose, const Vec3& up_B) noexcept {
  if (pose.attitude_at_ns == tilts_[(next_tilt_ + kTilts - 1) % kTilts].at_ns) return;  // told again
  tilts_[next_tilt_++ % kTilts] = {pose.attitude_at_ns, up_B};
}

Vec3 FlightTick::tilt_at(std::int64_t ns, const Vec3& newest_B) const noexcept {
  const Tilt* nearest = nullptr;
  for (const Tilt& tilt : tilts_)
    if (tilt.at_ns > 0 && (!nearest || std::abs(tilt.at_ns - ns) < std::abs(nearest->at_ns - ns))) nearest = &tilt;
  return nearest ? nearest->up_B : newest_B;
}

// What enabling allows, and three standard deviations of the two estimates against each other.
double FlightTick::apart(const TickInput& in) const noexcept {
  const double sigma = in.position_sigma ? static_cast<double>(*in.position_sigma) : std::numbers::sqrt2 * sigma_;
  return std::clamp(FrameAlignment::kMaxPosition + 3 * sigma, kLeastApart, kMostApart);
}

bool FlightTick::frames_apart(const TickInput& in) const noexcept { return alignment_.position_residual() > apart(in); }

// Odometry is a sensor of the autopilot's, not a command: it gets every good sample in every mode, so that its
// estimator stays right under a pilot's hands and after us. What we have stopped to believe in flight is not forwarded
// until the vehicle stands or follows us again.
bool FlightTick::feeds(const TickInput& in, bool fresh, Mode now) noexcept {
  const bool again = !in.autopilot.armed || now == Mode::tracking;
  const bool distrusted = odometry_distrusted_ || (was_commanding_ && !supervisor_.pose_trusted());
  feed_distrusted_ = distrusted || (feed_distrusted_ && !again);
  return fresh && !feed_distrusted_;
}

}  // namespace backwash::track
