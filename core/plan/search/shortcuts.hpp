// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/plan/world/safe_space.hpp"

namespace backwash::plan {

/// Limits of each axis.
struct AxisLimits {
  double v_max;  ///< m/s
  double a_max;  ///< m/s²
};

/// From a state to another in the least time in which each axis can accelerate with ±a_max to a speed within v_max,
/// keep it, and change with ±a_max to the speed wanted, all axes taking the same time. Nothing if it takes `longest` or
/// more (s), if a speed is beyond v_max, or if no time up to a third more than the slowest axis needs suits all axes.
/// Pieces of constant acceleration that join.
std::optional<std::vector<Motion>> quickest(const State& from, const State& to, const AxisLimits& limits,
                                            double longest);

/// From a state along points (m, W) to rest at the last, with stops at those that cannot be passed over: braking first,
/// from any speed. Empty if the braking or a piece between two neighbours is not clear.
std::vector<Motion> along(const SafeView& space, const State& start, std::span<const Vec3> points,
                          const AxisLimits& limits);

/// Replaces pieces by the quickest way between their ends where that is clear and lowers ∫‖u‖² dt + rho·T (Hauser and
/// Ng-Thow-Hing, "Fast smoothing of manipulator trajectories using optimal bounded-acceleration shortcuts", ICRA 2010).
/// Ends of pieces are taken from a fixed sequence that fills the duration evenly: deterministic.
std::vector<Motion> shortened(const SafeView& space, std::vector<Motion> motions, const AxisLimits& limits, double rho);

/// G = ∫‖u‖² dt + rho·T of motions that join, m²/s³.
double cost_of(std::span<const Motion> motions, double rho) noexcept;

}  // namespace backwash::plan
