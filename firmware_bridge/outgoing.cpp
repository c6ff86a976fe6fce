// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/outgoing.hpp"

#include <limits>

#include "firmware_bridge/mavlink/frames.hpp"

namespace backwash::firmware_bridge {
namespace {

// Values of common.xml.
constexpr std::uint8_t kFrameLocalNed = 1, kFrameBodyFrd = 12, kFrameLocalFrd = 20, kEstimatorVio = 3;
constexpr std::uint16_t kIgnoreYawRate = 1 << 11;

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
using UpperTriangle = std::array<float, 21>;

/// Upper triangle of the 6×6 diag(first, second); an absent first part marks all of it unknown, as MAVLink has it.
UpperTriangle covariance(const std::optional<Vec3>& first, const std::optional<Vec3>& second) noexcept {
  constexpr std::array<std::size_t, 6> kDiagonal{0, 6, 11, 15, 18, 20};
  UpperTriangle c{};
  for (std::size_t i = 0; i < 3; ++i) {
    c[kDiagonal[i]] = first ? static_cast<float>((*first)(static_cast<int>(i))) : kUnknown;
    c[kDiagonal[i + 3]] = second ? static_cast<float>((*second)(static_cast<int>(i))) : kUnknown;
  }
  return c;
}

/// A permutation of axes permutes variances; no sign changes them.
std::optional<Vec3> swap_variance_ned(const std::optional<Vec3>& v) noexcept {
  if (!v) return std::nullopt;
  return mavlink::swap_ned(*v).cwiseAbs();
}

std::int8_t quality(const std::optional<Vec3>& position_variance) noexcept {
  const double worst = position_variance ? std::max(position_variance->maxCoeff(), 0.0) : 0;
  return static_cast<std::int8_t>(std::lround(std::max(100 / (1 + worst / (kHalfQuality * kHalfQuality)), 1.0)));
}

}  // namespace

bool all_finite(const VioSample& s) noexcept {
  const auto finite_or_absent = [](const std::optional<Vec3>& v) { return !v || v->cast<float>().allFinite(); };
  return finite_or_absent(s.omega_B) && finite_or_absent(s.position_variance_O) &&
         finite_or_absent(s.attitude_variance_O) && finite_or_absent(s.velocity_variance_B);
}

mavlink::SetPositionTargetLocalNed setpoint_message(const Setpoint& s, std::uint32_t time_ms, Recipient to) noexcept {
  const Eigen::Vector3f p = mavlink::swap_ned(s.p_W).cast<float>();
  const Eigen::Vector3f v = mavlink::swap_ned(s.v_W).cast<float>();
  const Eigen::Vector3f a = mavlink::swap_ned(s.a_W).cast<float>();
  return {.time_boot_ms = time_ms,
          .x = p.x(),
          .y = p.y(),
          .z = p.z(),
          .vx = v.x(),
          .vy = v.y(),
          .vz = v.z(),
          .afx = a.x(),
          .afy = a.y(),
          .afz = a.z(),
          .yaw = static_cast<float>(mavlink::swap_yaw(s.yaw)),
          .type_mask = kIgnoreYawRate,
          .target_system = to.system,
          .target_component = to.component,
          .coordinate_frame = kFrameLocalNed};
}

mavlink::Odometry odometry_message(const VioSample& s) noexcept {
  const Eigen::Vector3f p = mavlink::swap_ned(s.p_O).cast<float>();
  const Eigen::Quaternionf q = mavlink::swap_ned_frd(s.q_OB).cast<float>();
  const Eigen::Vector3f v = mavlink::swap_frd(s.v_B).cast<float>();
  const Eigen::Vector3f w =
      s.omega_B ? Eigen::Vector3f(mavlink::swap_frd(*s.omega_B).cast<float>()) : Eigen::Vector3f::Constant(kUnknown);
  return {
      .time_usec = s.time_us,
      .x = p.x(),
      .y = p.y(),
      .z = p.z(),
      .q = {q.w(), q.x(), q.y(), q.z()},
      .vx = v.x(),
      .vy = v.y(),
      .vz = v.z(),
      .rollspeed = w.x(),
      .pitchspeed = w.y(),
      .yawspeed = w.z(),
      .pose_covariance = covariance(swap_variance_ned(s.position_variance_O), swap_variance_ned(s.attitude_variance_O)),
      .velocity_covariance = covariance(s.velocity_variance_B, std::nullopt),
      .frame_id = kFrameLocalFrd,
      .child_frame_id = kFrameBodyFrd,
      .reset_counter = s.reset_counter,
      .estimator_type = kEstimatorVio,
      .quality = quality(s.position_variance_O)};
}

}  // namespace backwash::firmware_bridge
