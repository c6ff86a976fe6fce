// SPDX-License-Identifier: BSD-3-Clause
// What a tick believes of poses: loop closures, odometry, and the controller's frame against the map's.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/track/flight_tick.hpp"
#include "core/types/time.hpp"

namespace backwash::track {
namespace {

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
void FlightTick::take_closure(std::optional<OdometrySample>& sample) noexcept {
  closure_refused_now_ = false;
  const double faded = was_commanding_ ? 1 - kControlPeriod / kClosureFades : 0;
  closed_m_ *= faded;
  closed_rad_ *= faded;
  if (!sample || sample->closures == closures_) return;
  const RigidShift D = sample->map_from_odom * map_from_odom_.inverse();
  const bool first = closures_ == 0;
  const OdometrySample before = moved(D.inverse(), *sample);
  // Written so that what is no number is refused.
  const double by = (sample->state.p_W - before.state.p_W).norm(), turn = std::abs(D.yaw);
  const bool small = closed_m_ + by <= kMaxClosure && closed_rad_ + turn <= kMaxClosureTurn;
  if (was_commanding_ && small) {
    closed_m_ += by;
    closed_rad_ += turn;
  }
  if (was_commanding_ && !small) {
    closure_refused_now_ = closure_refused_ != sample->closures;
    closure_refused_ = sample->closures;
    sample = before;
    sample->closures = closures_;
    sample->map_from_odom = map_from_odom_;
    return;
  }
  closure_refused_ = closures_ = sample->closures;
  map_from_odom_ = sample->map_from_odom;
  if (first) return tracker_.rebase({}, closures_);  // until now nothing was in the map by way of it
  gate_.rebase(D);
  alignment_.rebase(D);
  tracker_.rebase(D, closures_);
  if (floor_) *floor_ += D.t.z();
  command_ = D.setpoint(command_);
}

void FlightTick::take_odometry(const TickInput& in, const std::optional<OdometrySample>& sample,
                               TickOutput& out) noexcept {
  if (!sample) return;
  // After a jump or a gap a sample that looks good again may still be in another place: it is not believed, and not
  // forwarded, until the vehicle is in other hands.
  if (odometry_distrusted_) {
    out.verdict = OdometryGate::Verdict::rejected;
    return;
  }
  using Verdict = OdometryGate::Verdict;
  // A pose that repeats to the last bit is frozen in the air even if nothing is to move; standing, it may be still.
  const bool flies = in.autopilot.armed && (left_floor_ || in.autopilot.landed == false);
  const bool lifts = mode() == Mode::lifting;
  off_ground_ = lifts && flies ? off_ground_ + 1 : 0;
  const bool moving = lifts ? off_ground_ > kLeavesGround : command_.v_W.norm() > 0.05 || flies;
  out.verdict = gate_.take(*sample, moving);
  disorder_ = out.verdict == Verdict::disorder ? std::min(disorder_ + 1, kDisorder + 1) : 0;
  if (out.verdict == Verdict::good) {
    last_good_ns_ = std::min(sample->received_ns, in.now_ns) - nanoseconds(gate_.late());
    out.fresh = true;
  }
  const bool elsewhere = out.verdict == Verdict::jump || out.verdict == Verdict::inconsistent ||
                         disorder_ > kDisorder ||
                         (out.fresh && seconds(in.now_ns - *last_good_ns_) > supervisor_.hold_after());
  if (!elsewhere || was_commanding_) return;
  gate_.forget();
  floor_.reset();
  if (out.verdict == Verdict::jump || out.verdict == Verdict::inconsistent) ++odometry_resets_;
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
void FlightTick::feed(const TickInput& in, TickOutput& out) noexcept {
  const bool again = !in.autopilot.armed || out.supervisor.mode == Mode::tracking;
  const bool distrusted = odometry_distrusted_ || (was_commanding_ && !supervisor_.pose_trusted());
  feed_distrusted_ = distrusted || (feed_distrusted_ && !again);
  out.forward_odometry = out.fresh && !feed_distrusted_;
  out.odometry_resets = odometry_resets_;
}

}  // namespace backwash::track
