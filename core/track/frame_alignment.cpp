// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/frame_alignment.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace backwash::track {
namespace {

// Low-pass weights at 50 Hz: the transform averages over 1 s, the residuals over 0.2 s.
constexpr double kLearn = 0.02, kWatch = 0.1;

}  // namespace

double wrap_angle(double angle) noexcept {
  angle = std::remainder(angle, 2 * std::numbers::pi);
  return angle <= -std::numbers::pi ? std::numbers::pi : angle;
}

Vec3 FrameAlignment::rotate(const Vec3& v) const noexcept {
  const double c = std::cos(yaw_), s = std::sin(yaw_);
  return {c * v.x() - s * v.y(), s * v.x() + c * v.y(), v.z()};
}

void FrameAlignment::update(const YawPose& in_map, const YawPose& in_local, bool learn) noexcept {
  const double yaw = wrap_angle(in_local.yaw - in_map.yaw);
  if (learn) {
    // A running mean first, then a low-pass: the first samples count as much as later ones.
    const double weight = std::max(kLearn, 1.0 / (samples_ + 1));
    yaw_ = wrap_angle(yaw_ + weight * wrap_angle(yaw - yaw_));
    translation_ += weight * (in_local.p - rotate(in_map.p) - translation_);
  }
  const double position_error = (in_local.p - rotate(in_map.p) - translation_).norm();
  const double yaw_error = std::abs(wrap_angle(yaw - yaw_));
  position_residual_ += kWatch * (position_error - position_residual_);
  yaw_residual_ += kWatch * (yaw_error - yaw_residual_);
  samples_ = std::min(samples_ + 1, 1'000'000);
}

bool FrameAlignment::aligned() const noexcept {
  return samples_ >= kMinSamples && position_residual_ < kMaxPosition && yaw_residual_ < kMaxYaw;
}

Setpoint FrameAlignment::to_local(const Setpoint& in_map) const noexcept {
  return {rotate(in_map.p_W) + translation_, rotate(in_map.v_W), rotate(in_map.a_W), wrap_angle(in_map.yaw + yaw_)};
}

}  // namespace backwash::track
