// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>

#include "core/plan/spline/bspline.hpp"
#include "core/plan/world/world.hpp"

namespace backwash::plan {

/// Limits per axis of a trajectory. A start above them must slow down: what it may have falls by a quarter of the
/// largest acceleration.
struct MotionLimits {
  Vec3 v, a;                    ///< m/s, m/s²
  Vec3 v_start = Vec3::Zero();  ///< of the command continued, m/s
  /// Of velocity control point i, which speaks for t = (i − ½)·Δ, m/s.
  Vec3 velocity(std::size_t point, double knot_span) const noexcept {
    const double t = std::max(0.0, static_cast<double>(point) - 0.5) * knot_span;
    return v.cwiseMax(v_start.cwiseAbs() - t / 4 * a);
  }
  MotionLimits scaled(double share) const noexcept { return {share * v, share * a, share * v_start}; }
};

/// A curve and the sets that fly it.
struct Flown {
  const BSpline& curve;
  const reach::ReachTube& tube;  ///< of the curve's commands, at least
};

struct LeastJerk {
  BSpline curve;
  std::size_t steps = 0;  ///< of Newton's method
};
/// The curve of least ∫‖p⃛‖² dt beside obstacles and within limits, from one that is clear of obstacles
/// (docs/model.md 5b-4 to 5b-7). Its ends and its knot span are kept. Each sample along it keeps `margin` (m) beyond
/// the set that belongs to it: of the flight along a curve with as many control points, or of hovering at its place
/// where none was flown (null). To first order, so that its tube must be verified. `norm`: a set counts as the ball
/// about its x, y and z, as the paper has it. A step costs O(control points).
LeastJerk least_jerk(const World& world, const BSpline& curve, const Flown* flown, double margin,
                     const MotionLimits& limits, bool norm = false);

}  // namespace backwash::plan
