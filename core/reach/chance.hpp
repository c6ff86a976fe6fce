// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "core/reach/reach_tube.hpp"
#include "core/reach/response/coloured_error.hpp"
#include "core/types/disturbance.hpp"

// Chance-constrained sets (docs/model.md section 5.3): no worst case, but a stated probability of leaving them. In
// direction
// n
//   e_n = (support under the mean push and from the first set) + Gaussian part,  w_n(t) = s_n(t) ξ(t),  s_n = √(nᵀΣn),
// with ξ stationary, Gaussian, of variance 1 and correlation e^{−|τ|/τ_w} (Ornstein–Uhlenbeck). The Gaussian part has
// the covariance of a Lyapunov recursion along the path, and its bound is level × σ_e(t).
namespace backwash::reach {

/// A chance-constrained tube. `half_widths` are the mean push's support plus level × σ_e, w_bar the scale s (m/s²).
struct ChanceTube {
  ReachTube steps;
  std::vector<PerDirection> level;  ///< of each begun second, in standard deviations
};

/// Tube along held commands whose prism the error leaves with at most `probability` in each second of flight (pro rata
/// in one that has only begun), for the modelled disturbance, in the sense of the union bound: every direction gets a
/// fifth of 9/10 of it (the rest covers quadrature and the Padé delay), spent by exit_level(). Σ_k holds during step k;
/// sizes equal. O(N), some µs per step and direction. Errors: throws std::invalid_argument for unequal sizes, a
/// probability outside (0, 1), tau_w ≤ 0, a method other than tight, or Loop::sampled, whose covariance is not built.
ChanceTube chance_tube_with_variances(const Reachability& reach, const State& start, const Setpoint& previous,
                                      std::span<const Setpoint> commands, std::span<const Variance> sigma,
                                      const BoundModel& model, double probability);

/// The same through a map: s of each step is the maximum over the voxels that the chance-constrained set can reach in
/// it. `bounds` must hold w̄ = mean + κ s of `model`. Errors: also throws std::invalid_argument for κ = 0.
ChanceTube chance_tube_over_field(const Reachability& reach, const State& start, const Setpoint& previous,
                                  std::span<const Setpoint> commands, const BoundField& bounds, const BoundModel& model,
                                  double probability);

}  // namespace backwash::reach
