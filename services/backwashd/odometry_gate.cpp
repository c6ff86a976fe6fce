// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/odometry_gate.hpp"

#include <cmath>

namespace backwash::daemon {

OdometryGate::Verdict OdometryGate::take(const OdometrySample& sample, bool moving) noexcept {
  constexpr double kUnit = 1e-2;
  constexpr int kFrozen = 5;
  const auto& q = sample.q;
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  // Written so that NaN is rejected.
  if (!sample.state.p_W.allFinite() || !sample.state.v_W.allFinite() || !(std::abs(norm - 1) < kUnit))
    return Verdict::rejected;
  if (!last_) {
    last_ = sample;
    return Verdict::good;
  }
  if (sample.stamp_ns <= last_->stamp_ns) return Verdict::rejected;
  identical_ = sample.state.p_W == last_->state.p_W && q == last_->q ? identical_ + 1 : 0;
  if (moving && identical_ >= kFrozen - 1) return Verdict::rejected;
  const double dt = static_cast<double>(sample.stamp_ns - last_->stamp_ns) * 1e-9;
  const Vec3 predicted = last_->state.p_W + dt * last_->state.v_W;
  if (!((sample.state.p_W - predicted).norm() <= v_max_ * dt + 3 * sigma_)) return Verdict::jump;
  last_ = sample;
  return Verdict::good;
}

}  // namespace backwash::daemon
