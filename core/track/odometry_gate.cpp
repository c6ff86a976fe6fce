// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/odometry_gate.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace backwash::track {

OdometryGate::Verdict OdometryGate::take(const OdometrySample& sample, bool moving) noexcept {
  constexpr double kUnit = 1e-2;
  const auto& q = sample.q;
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  // Written so that NaN is rejected.
  if (!sample.state.p_W.allFinite() || !sample.state.v_W.allFinite() || !(std::abs(norm - 1) < kUnit))
    return Verdict::rejected;
  if (!last_) {
    last_ = sample;
    return Verdict::good;
  }
  const double by_stamp = static_cast<double>(sample.stamp_ns - last_->stamp_ns) * 1e-9;
  const double by_reception = static_cast<double>(sample.received_ns - last_->received_ns) * 1e-9;
  const bool clock_was_set = std::abs(by_stamp - by_reception) > kClockStep;
  const double dt = clock_was_set ? std::max(0.0, by_reception) : by_stamp;
  if (!clock_was_set && by_stamp <= 0) return Verdict::disorder;
  // Counts the samples that repeat the last good pose, which is the first of the row. At rest an estimator may well
  // stand still.
  const bool repeats = sample.state.p_W == last_->state.p_W && q == last_->q;
  identical_ = moving && repeats ? std::min(identical_ + 1, kFrozen) : 0;
  if (identical_ >= kFrozen - 1) return Verdict::frozen;
  const Vec3 predicted = last_->state.p_W + dt * last_->state.v_W;
  if (!((sample.state.p_W - predicted).norm() <= v_max_ * dt + 3 * sigma_)) return Verdict::jump;
  last_ = sample;
  return Verdict::good;
}

void OdometryGate::rebase(const RigidShift& D) noexcept {
  if (!last_) return;
  last_->state = D.state(last_->state);
  const Eigen::Quaterniond turned = Eigen::Quaterniond(Eigen::AngleAxisd(D.yaw, Vec3::UnitZ())) *
                                    Eigen::Quaterniond(last_->q[0], last_->q[1], last_->q[2], last_->q[3]);
  last_->q = {turned.w(), turned.x(), turned.y(), turned.z()};
}

}  // namespace backwash::track
