// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <numbers>

namespace backwash {

inline constexpr double kDegree = std::numbers::pi / 180;  ///< rad

/// Angle wrapped to (−π, π], rad.
inline double wrap_angle(double angle) noexcept {
  angle = std::remainder(angle, 2 * std::numbers::pi);
  return angle <= -std::numbers::pi ? std::numbers::pi : angle;
}

}  // namespace backwash
