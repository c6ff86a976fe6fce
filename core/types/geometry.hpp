// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>

namespace backwash {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Index3 = Eigen::Vector3i;  ///< Voxel index (i, j, k) along world x, y, z.

/// Period of the control loop and of every reachable-set step, s (docs/model.md section 5: 50 Hz).
inline constexpr double kControlPeriod = 0.02;
/// Standard gravity, m/s².
inline constexpr double kGravity = 9.80665;

/// The five directions in which reachable sets carry an exact support: the axes and both horizontal diagonals
/// (1, 1)/√2 and (1, −1)/√2 of the world frame. Together they bound an octagonal prism (docs/model.md section 5.2).
enum Direction : std::size_t { kX = 0, kY = 1, kZ = 2, kXyPlus = 3, kXyMinus = 4, kDirections = 5 };

/// One number per Direction; what it holds (half width in m, bound in m/s²) is said where it is used.
using PerDirection = std::array<double, kDirections>;

/// Unit vector of a Direction in the world frame.
inline Vec3 unit(Direction d) noexcept {
  constexpr double s = 0.70710678118654752440;
  switch (d) {
    case kX:
      return {1, 0, 0};
    case kY:
      return {0, 1, 0};
    case kZ:
      return {0, 0, 1};
    case kXyPlus:
      return {s, s, 0};
    default:
      return {s, -s, 0};
  }
}

}  // namespace backwash
