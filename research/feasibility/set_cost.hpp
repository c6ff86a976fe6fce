// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/plan/world/world.hpp"

namespace backwash::plan {

/// What taking Σ over the set instead of at its centre costs (docs/model.md section 3).
struct SetCost {
  std::size_t safe_at_centre = 0;         ///< voxels that would be hover-safe with Σ of their centre
  std::size_t lost = 0;                   ///< of these, not hover-safe with Σ over the set
  double median_m = 0, quantile95_m = 0;  ///< clearance given up at the others with less than the cap, m
};
/// Precondition: method tight, no constant margin. Clearances are looked for where bounds on them leave the quantiles
/// open. O(voxels · prism_distance): offline.
SetCost cost_of_set(const World& world, const Parallel& parallel = run_serial);

/// The hover set against a ball of constant radius in its place, over the free voxels where body and estimation fit
/// (distance > body.radius + estimation.position): where one holds the other, hovering safely with the larger implies
/// it with the smaller, whatever stands around.
struct AgainstMargin {
  double margin_m;
  std::size_t voxels = 0;           ///< of these,
  std::size_t ball_inside_set = 0;  ///< voxels where every face of the set is at least the margin away
  std::size_t set_inside_ball = 0;  ///< voxels where no corner is farther away than it
  std::size_t unbounded = 0;        ///< voxels where the set leaves the clear space: in neither count
  std::size_t only_ball_safe = 0;   ///< voxels where hovering is safe with the ball and not with the set
  std::size_t only_set_safe = 0;    ///< and the other way round
};
/// One entry a margin. Precondition: no constant margin in the world. O(voxels · prism_distance): offline.
std::vector<AgainstMargin> set_against_margins(const World& world, const std::vector<double>& margins_m,
                                               const Parallel& parallel = run_serial);

}  // namespace backwash::plan
