// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/frame_alignment.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace backwash::track {
namespace {

// Low-pass weights of a pair, at 50 Hz: the transform averages over 1 s, the residuals over 0.2 s; velocities fade over
// 5 s.
constexpr double kLearn = 0.02, kWatch = 0.1, kFade = 0.996;
constexpr double kLongestStep = 0.1;  // s: the velocity is not carried on for longer
// s: gyros are, by the mean of both ends, as long as the autopilot's pose is used at all (Supervisor::kPoseSilent): at
// 10 Hz and below a turn would go unseen. A heading that changes its rate by 2 rad/s² within adds at most 2.6°.
constexpr double kLongestTurn = 0.31;

/// The weight of the newest of `samples` that are one.
double of_several(double weight, double samples) noexcept {
  return samples > 1 ? 1 - std::pow(1 - weight, samples) : weight;
}

}  // namespace

FrameAlignment::FrameAlignment(const OdometryTiming& timing) noexcept
    : learn_(of_several(kLearn, timing.usual_samples())),
      watch_(of_several(kWatch, timing.usual_samples())),
      fade_(std::pow(kFade, timing.usual_samples())),
      longest_step_(kLongestStep + timing.longer_gap()) {}

Vec3 FrameAlignment::rotate(const Vec3& v) const noexcept { return RigidShift{yaw_, Vec3::Zero()}.rotate(v); }

void FrameAlignment::update(const FramePose& in_map, const FramePose& in_local, double dt, bool learn) noexcept {
  watch_tilt(in_map, in_local);
  watch_turn(in_map, in_local, dt);
  map_yaw_ = in_map.yaw;
  local_ = in_local;
  const double yaw = wrap_angle(in_local.yaw - in_map.yaw);
  if (learn) {
    // A running mean first, then a low-pass: the first samples count as much as later ones.
    const double weight = std::max(learn_, 1.0 / (samples_ + 1));
    yaw_ = wrap_angle(yaw_ + weight * wrap_angle(yaw - yaw_));
    translation_ += weight * (in_local.p - rotate(in_map.p) - translation_);
    correlate(in_map, in_local);
  }
  const double position_error = (in_local.p - rotate(in_map.p) - translation_).norm();
  const double yaw_error = std::abs(wrap_angle(yaw - yaw_));
  position_residual_ += watch_ * (position_error - position_residual_);
  yaw_residual_ += watch_ * (yaw_error - yaw_residual_);
  samples_ = std::min(samples_ + 1, 1'000'000);
}

// Autopilots whose heading follows the odometry turn along with it: then only their gyros can contradict it.
void FrameAlignment::watch_turn(const FramePose& in_map, const FramePose& in_local, double dt) noexcept {
  const bool gap = samples_ == 0 || !(dt > 0 && dt < kLongestTurn);
  const double by_gyros = dt / 2 * (local_.yaw_rate + in_local.yaw_rate);
  gyro_turn_ = gap ? 0 : std::exp(-dt / kTurnOver) * gyro_turn_ + wrap_angle(in_map.yaw - map_yaw_) - by_gyros;
}

// The rotation from one up to the other, as an angle about the body's x and y axes; past 90° it is as wrong.
void FrameAlignment::watch_tilt(const FramePose& in_map, const FramePose& in_local) noexcept {
  const Vec3 axis = in_map.up_B.cross(in_local.up_B);
  const bool upside_down = in_map.up_B.dot(in_local.up_B) < 0;
  roll_ += watch_ * ((upside_down ? std::numbers::pi : std::asin(std::clamp(axis.x(), -1.0, 1.0))) - roll_);
  pitch_ += watch_ * (std::asin(std::clamp(axis.y(), -1.0, 1.0)) - pitch_);
}

void FrameAlignment::rebase(const FramePose& in_map, const FramePose& in_local) noexcept {
  yaw_ = wrap_angle(in_local.yaw - in_map.yaw);
  translation_ = in_local.p - rotate(in_map.p);
  position_residual_ = yaw_residual_ = 0;
}

void FrameAlignment::rebase(const RigidShift& D) noexcept {
  const RigidShift local_from_new = RigidShift{yaw_, translation_} * D.inverse();
  yaw_ = local_from_new.yaw;
  translation_ = local_from_new.t;
  map_yaw_ = wrap_angle(map_yaw_ + D.yaw);
}

bool FrameAlignment::reset_between(const FramePose& in_map, const FramePose& in_local) const noexcept {
  return samples_ >= kMinSamples && ((in_local.p - rotate(in_map.p) - translation_).norm() > kResetPosition ||
                                     std::abs(wrap_angle(in_local.yaw - in_map.yaw - yaw_)) > kResetYaw);
}

// As far as a pair may lie from the transform already may hide a part of the reset.
bool FrameAlignment::local_jumped(const FramePose& in_local, double dt) const noexcept {
  if (samples_ == 0 || !(dt > 0 && dt < longest_step_)) return false;
  const Vec3 carried = local_.p + dt / 2 * (local_.v + in_local.v);
  const double turned = local_.yaw + dt / 2 * (local_.yaw_rate + in_local.yaw_rate);
  return (in_local.p - carried).norm() > kResetPosition - kMaxPosition ||
         std::abs(wrap_angle(in_local.yaw - turned)) > kResetYaw - kMaxYaw;
}

bool FrameAlignment::aligned() const noexcept { return agree(kMaxPosition); }

bool FrameAlignment::agree(double position) const noexcept {
  return samples_ >= kMinSamples && position_residual_ < position && yaw_residual_ < kMaxYaw &&
         std::hypot(roll_, pitch_) < kMaxTilt && std::abs(gyro_turn_) < kMaxGyroTurn;
}

void FrameAlignment::correlate(const FramePose& in_map, const FramePose& in_local) noexcept {
  cross_ = fade_ * cross_ + RigidShift{-yaw_, Vec3::Zero()}.rotate(in_local.v) * in_map.v.transpose();
  energy_ = fade_ * energy_ + in_map.v.cwiseProduct(in_map.v);
}

Mismatch FrameAlignment::mismatch() const noexcept {
  if (std::max(std::abs(roll_), std::abs(pitch_)) > kMaxTilt)
    return std::abs(roll_) >= std::abs(pitch_) ? Mismatch::roll : Mismatch::pitch;
  if (energy_.z() > kExcited && cross_(2, 2) < kLeastGain * energy_.z()) return Mismatch::z;
  return horizontal_mismatch();
}

Mismatch FrameAlignment::horizontal_mismatch() const noexcept {
  const double energy = energy_.x() + energy_.y();
  if (energy <= kExcited) return Mismatch::none;
  // If the local velocity is the map's turned by θ, cross = R(θ) Σ v vᵀ, whose rotational part is exactly the energy.
  const double sine = cross_(1, 0) - cross_(0, 1), cosine = cross_(0, 0) + cross_(1, 1);
  if (std::hypot(sine, cosine) > kLeastRotation * energy)
    return std::abs(std::atan2(sine, cosine)) > kMaxTurn ? Mismatch::yaw : Mismatch::none;
  // No rotation explains it: an axis is mirrored, dead or scaled. The one with the lower gain is named.
  const double least = kExcited / 2;
  const double gain_x = energy_.x() > least ? cross_(0, 0) / energy_.x() : 1;
  const double gain_y = energy_.y() > least ? cross_(1, 1) / energy_.y() : 1;
  return gain_x <= gain_y ? Mismatch::x : Mismatch::y;
}

Setpoint FrameAlignment::to_local(const Setpoint& in_map) const noexcept {
  return {rotate(in_map.p_W) + translation_, rotate(in_map.v_W), rotate(in_map.a_W), wrap_angle(in_map.yaw + yaw_)};
}

}  // namespace backwash::track
