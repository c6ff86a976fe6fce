// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
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
  /// Control points of the first derivative, m/s: their hull bounds the velocity.
  std::vector<Vec3> velocity_points() const;
  /// Control points of the second derivative, m/s²: their hull bounds the acceleration.
  std::vector<Vec3> acceleration_points() const;
  /// ∫ ‖p⃛‖² dt over the whole spline, exact, (m/s³)² s.
  double jerk2() const noexcept;
};

/// Where t falls: control points first … first + 3 with these weights give the derivative of the given order there.
struct BSplineWeights {
  std::size_t first;
  std::array<double, 4> weight;  ///< 1/s^order
};
/// Weights of the four control points at t (clamped to the spline), for n control points of span Δ.
BSplineWeights weights(std::size_t control_points, double knot_span, double t, int order) noexcept;

/// The three control points that give position, velocity and acceleration (m, m/s, m/s²) at a knot, in order.
std::array<Vec3, 3> end_control_points(const Vec3& p, const Vec3& v, const Vec3& a, double knot_span) noexcept;

/// Spline through samples taken every `knot_span` (at least 2), with the given velocities and accelerations at both
/// ends. The ends are exact, the samples between are met in the least-squares sense. Fewer than 4 samples cannot carry
/// both ends: the knot span is then divided, samples between being interpolated linearly. O(n³), n the number of
/// samples.
BSpline fit(const std::vector<Vec3>& samples, double knot_span, const Vec3& v_start, const Vec3& a_start,
            const Vec3& v_end, const Vec3& a_end);

}  // namespace backwash::plan
