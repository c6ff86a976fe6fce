// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/types/state.hpp"
#include "firmware_bridge/mavlink/messages.hpp"

namespace backwash::firmware_bridge {

/// A VIO sample to be forwarded. The VIO's frame O is z-up; sending it as one frame with the controller's local frame L
/// means that a controller that follows it in position and yaw has L = O.
struct VioSample {
  std::uint64_t time_us = 0;                                     ///< monotonic
  Vec3 p_O;                                                      ///< m
  Eigen::Quaterniond q_OB;                                       ///< body FLU to O
  Vec3 v_B;                                                      ///< velocity of the body, in body FLU, m/s
  std::optional<Vec3> omega_B;                                   ///< rad/s, FLU; absent: not known
  std::optional<Vec3> position_variance_O, attitude_variance_O;  ///< per axis of O, m², rad²
  std::optional<Vec3> velocity_variance_B;                       ///< per axis of B, (m/s)²
  std::uint8_t reset_counter = 0;                                ///< counts jumps of O, as loop closures make them
};

/// m, standard deviation of the worst axis at which ODOMETRY's quality is 50 %: 100 / (1 + (σ / this)²). One that says
/// none has 100: only what passed every test is sent.
inline constexpr double kHalfQuality = 0.1;

/// What is given is a number; what is absent becomes NaN on purpose.
bool all_finite(const VioSample& sample) noexcept;

/// Whom a message is for.
struct Recipient {
  std::uint8_t system = 0, component = 0;
};

/// Set-point in the controller's local frame L, z-up, as MAVLink has it. Real-time, as the next one.
mavlink::SetPositionTargetLocalNed setpoint_message(const Setpoint& setpoint_L, std::uint32_t time_ms,
                                                    Recipient to) noexcept;
/// Rates and covariances that are absent are NaN: "not known" of MAVLink.
mavlink::Odometry odometry_message(const VioSample& sample) noexcept;

/// Every float of the message is a number, but for those of ODOMETRY that may be marked as unknown.
template <class Message>
bool all_finite(const Message& message) noexcept {
  const auto number = [&]<class Member>(const mavlink::Field<Message, Member>& f) {
    using Scalar = typename mavlink::Wire<Member>::Scalar;
    if constexpr (!std::is_same_v<Scalar, float>) {
      return true;
    } else if constexpr (mavlink::Wire<Member>::kArray > 0) {
      return f.name.ends_with("_covariance") ||
             std::ranges::all_of(message.*f.member, [](float v) { return std::isfinite(v); });
    } else {
      const bool rate = std::is_same_v<Message, mavlink::Odometry> && f.name.ends_with("speed");
      return rate || std::isfinite(message.*f.member);
    }
  };
  return std::apply([&](const auto&... f) { return (number(f) && ...); }, Message::fields());
}

}  // namespace backwash::firmware_bridge
