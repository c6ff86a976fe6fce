// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/types/state.hpp"

namespace backwash::plan {

/// Uniform cubic B-spline in W. With n control points (n ≥ 4) and knot span Δ it lasts (n − 3)·Δ.
struct BSpline {
  std::vector<Vec3> control_points;  ///< m
  double knot_span = 0;              ///< Δ, s

  double duration() const noexcept;
  /// Derivative of order 0 … 3 at t (clamped to [0, duration]), m/s^order.
  Vec3 derivative(double t, int order) const noexcept;
  /// Set-point at t: position, velocity, acceleration; past the end the end point with zero velocity and acceleration.
  Setpoint at(double t) const noexcept;
  /// Commands every 20 ms from 0 until the end is reached.
  std::vector<Setpoint> commands() const;
};

/// Spline through samples taken every `knot_span` (at least 2), with the given velocities and accelerations at both ends.
BSpline fit(const std::vector<Vec3>& samples, double knot_span, const Vec3& v_start, const Vec3& a_start,
            const Vec3& v_end, const Vec3& a_end);

}  // namespace backwash::plan
