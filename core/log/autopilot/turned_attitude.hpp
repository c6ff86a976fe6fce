// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cmath>

namespace backwash::log {

/// An attitude over north, east, down as one over east, north, up: (0, √½, √½, 0) ⊗ q.
inline Eigen::Quaterniond enu_of_ned(const Eigen::Quaterniond& q) noexcept {
  const double s = std::sqrt(0.5);
  return {-s * (q.x() + q.y()), s * (q.w() + q.z()), s * (q.w() - q.z()), s * (q.y() - q.x())};
}

/// An attitude of a body forward, right, down as one of the body forward, left, up: q ⊗ (0, 1, 0, 0).
inline Eigen::Quaterniond flu_of_frd(const Eigen::Quaterniond& q) noexcept { return {-q.x(), q.w(), q.z(), -q.y()}; }

}  // namespace backwash::log
