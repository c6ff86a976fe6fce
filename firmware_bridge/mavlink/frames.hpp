// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "core/types/angle.hpp"
#include "core/types/geometry.hpp"

// The one place of NED and FRD. Elsewhere the world is z-up (x east, y north when it is aligned with the earth) and the
// body is x forward, y left, z up. Every map here is its own inverse, so one function serves both directions; all are
// real-time: wait-free, no allocation.

namespace backwash::mavlink {

/// World vector, z-up (east, north, up) ↔ NED: (x, y, z) → (y, x, −z). Any unit.
inline Vec3 swap_ned(const Vec3& v) noexcept { return {v.y(), v.x(), -v.z()}; }

/// Body vector, FLU ↔ FRD: (x, y, z) → (x, −y, −z). Any unit.
inline Vec3 swap_frd(const Vec3& v) noexcept { return {v.x(), -v.y(), -v.z()}; }

/// Attitude, body FLU to z-up world ↔ body FRD to NED: q ↦ q_NW ⊗ q ⊗ q_BF with q_NW the half turn about (1, 1, 0)/√2
/// and q_BF the half turn about x. The sign of the result is chosen so that w ≥ 0. Unit quaternions only.
inline Eigen::Quaterniond swap_ned_frd(const Eigen::Quaterniond& q) noexcept {
  constexpr double s = std::numbers::sqrt2 / 2;
  const Eigen::Quaterniond r = Eigen::Quaterniond(0, s, s, 0) * q * Eigen::Quaterniond(0, 1, 0, 0);
  return r.w() < 0 ? Eigen::Quaterniond(-r.w(), -r.x(), -r.y(), -r.z()) : r;
}

/// Heading, counter-clockwise from world x (east) ↔ clockwise from north: ψ ↦ π/2 − ψ, wrapped to (−π, π], rad.
inline double swap_yaw(double yaw) noexcept { return wrap_angle(std::numbers::pi / 2 - yaw); }

}  // namespace backwash::mavlink
