// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "core/plan/feasibility.hpp"
#include "core/plan/world/world.hpp"

namespace backwash::plan {

/// A vehicle with other gains of its position loop, and what a way is for it.
struct GainStep {
  double factor = 1;               ///< on both firmware gains: k_p = factor²·k_p, k_d = factor·k_d; damping stays
  bool stable = false;             ///< with the vehicle file's delay and lag; all below is empty otherwise
  Vehicle::HorizontalVertical kp;  ///< 1/s²
  Vehicle::HorizontalVertical kd;  ///< 1/s
  std::optional<Bottleneck> way;   ///< nothing: no free voxels lead there
  reach::HoverSet set;             ///< at the way's tightest place
  bool passable() const noexcept { return way && way->passable; }
};

/// The way from `start_W` to `goal_W` with the gains of `world`'s vehicle times `factor`, in the same airflow. Faster
/// gains answer the wash sooner, until delay and lag make them answer too late. Cost: a hover map and a maximin search.
GainStep with_gains(const World& world, const Vec3& start_W, const Vec3& goal_W, double factor,
                    const Parallel& parallel = run_serial);

struct GainSweep {
  std::vector<GainStep> steps;       ///< in the order of `factors`
  std::optional<GainStep> smallest;  ///< that lets the vehicle through, to 1 %; nothing: none of the factors does
};

/// with_gains() for each factor (rising), and by bisection between the first that lets the vehicle through and the one
/// before it the smallest that does.
GainSweep sweep_gains(const World& world, const Vec3& start_W, const Vec3& goal_W, const std::vector<double>& factors,
                      const Parallel& parallel = run_serial);

}  // namespace backwash::plan
