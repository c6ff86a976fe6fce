// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/odometry_gate.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/track/frame_alignment.hpp"

namespace backwash::track {
namespace {

Eigen::Quaterniond quaternion(const std::array<double, 4>& q) noexcept { return {q[0], q[1], q[2], q[3]}; }

double angle_between(const Vec3& a, const Vec3& b) noexcept { return std::atan2(a.cross(b).norm(), a.dot(b)); }

}  // namespace

double heading(const std::array<double, 4>& q) noexcept {
  return std::atan2(2 * (q[0] * q[3] + q[1] * q[2]), 1 - 2 * (q[2] * q[2] + q[3] * q[3]));
}

Vec3 up_in_body(const std::array<double, 4>& q) noexcept { return quaternion(q).conjugate() * Vec3::UnitZ(); }

OdometrySample moved(const RigidShift& D, OdometrySample sample) noexcept {
  sample.state = D.state(sample.state);
  const Eigen::Quaterniond turned = Eigen::Quaterniond(Eigen::AngleAxisd(D.yaw, Vec3::UnitZ())) * quaternion(sample.q);
  sample.q = {turned.w(), turned.x(), turned.y(), turned.z()};
  return sample;
}

// Each comparison is written so that what is no number jumps.
bool OdometryGate::jumps(const OdometrySample& sample, double dt) const noexcept {
  const Vec3 predicted = last_->state.p_W + dt * last_->state.v_W;
  if (!((sample.state.p_W - predicted).norm() <= v_max_ * dt + 3 * sigma_)) return true;
  const double sigma_v = sigma_ / PoseDrift::kSettle;
  if (!((sample.state.v_W - last_->state.v_W).norm() <= kMaxAcceleration * dt + kVelocityNoises * sigma_v)) return true;
  if (!(std::abs(wrap_angle(heading(sample.q) - heading(last_->q))) <= kMaxYawRate * dt + kAngleNoise)) return true;
  return !(angle_between(up_in_body(sample.q), up_in_body(last_->q)) <= kMaxTiltRate * dt + kAngleNoise);
}

// What an estimator says of its twist counts as it says it: one that boasts is still granted estimation.position.
bool OdometryGate::contradicts(const OdometrySample& sample, double dt) noexcept {
  if (dt > longest_step_) {
    drift_.begin_anew();
    return false;
  }
  const auto& said = sample.velocity_variance;
  return !drift_.explains({dt, sample.state.p_W - last_->state.p_W, dt / 2 * (last_->state.v_W + sample.state.v_W),
                           sample.state.v_W - last_->state.v_W,
                           said ? std::sqrt(said->maxCoeff()) : PoseDrift::velocity_error(sigma_)});
}

void OdometryGate::time(const OdometrySample& sample, bool clock_was_set) noexcept {
  constexpr std::int64_t kClockDrift = 10'000;  // one in so many: 100 ppm, whatever the samples' rate
  const std::int64_t way = sample.received_ns - sample.stamp_ns;
  if (!fastest_ns_ || clock_was_set || way < *fastest_ns_)
    fastest_ns_ = way;
  else if (last_)
    *fastest_ns_ += std::max<std::int64_t>(0, sample.received_ns - last_->received_ns) / kClockDrift;
  late_ns_ = std::max<std::int64_t>(0, way - *fastest_ns_);
}

OdometryGate::Verdict OdometryGate::take(const OdometrySample& sample, bool moving) noexcept {
  constexpr double kUnit = 1e-2;
  const auto& q = sample.q;
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  // Written so that NaN is rejected.
  if (!sample.state.p_W.allFinite() || !sample.state.v_W.allFinite() || !(std::abs(norm - 1) < kUnit))
    return Verdict::rejected;
  if (!(sample.state.v_W.norm() <= kOverspeed * v_max_)) return Verdict::jump;
  if (!last_) {
    time(sample, false);
    last_ = sample;
    return Verdict::good;
  }
  const double by_stamp = seconds(sample.stamp_ns - last_->stamp_ns);
  const double by_reception = std::max(0.0, seconds(sample.received_ns - last_->received_ns));
  const bool clock_was_set = std::abs(by_stamp - by_reception) > kClockStep;
  if (!clock_was_set && by_stamp <= 0) return Verdict::disorder;
  const double dt = clock_was_set ? by_reception : std::min(by_stamp, by_reception + late());
  time(sample, clock_was_set);
  // Counts the samples that repeat the last good pose, which is the first of the row. At rest an estimator may well
  // stand still.
  const bool repeats = sample.state.p_W == last_->state.p_W && q == last_->q;
  identical_ = moving && repeats ? std::min(identical_ + 1, frozen_) : 0;
  if (identical_ >= frozen_ - 1) return Verdict::frozen;
  if (jumps(sample, dt)) return Verdict::jump;
  if (contradicts(sample, dt)) return Verdict::inconsistent;
  last_ = sample;
  return Verdict::good;
}

void OdometryGate::rebase(const RigidShift& D) noexcept {
  if (!last_) return;
  last_ = moved(D, *last_);
  drift_.rebase(D);
}

}  // namespace backwash::track
