// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

#include "core/map/distance_field.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/reach/reach_tube.hpp"
#include "core/types/disturbance.hpp"

// The risk of touching along a flight, and the sets that a stated risk asks for (docs/model.md section 5.3).
namespace backwash::reach {

/// κ of sets beside which a loop in steady air may be for so many seconds at this risk, towards one obstacle: level ×
/// σ_e/h_∞, the larger of both axes (5.3-5). It says where to look, and promises nothing; risk_of_touching() does. Some
/// ms. Errors: throws std::invalid_argument for a risk outside (0, 1) and for tau_w ≤ 0.
double kappa_of(const Reachability& reach, double tau_w, double risk, double seconds);

/// The risk of a flight, and where most of it comes from.
struct Risk {
  double total = 0;    ///< expected number of touches: at least the probability of one; more than `enough`: so far
  double largest = 0;  ///< that of the worst second
  double t = 0;        ///< s since the tube's start, of that second's worst entry
  Vec3 center_W = Vec3::Zero();     ///< predicted position there, m
  Vec3 obstacle_W = Vec3::Zero();   ///< what is nearest to it by the error's own measure, m
  double clearance = 0, sigma = 0;  ///< there: m that are left for the error, and its deviation towards the obstacle, m
  double a_minute = 0;              ///< expected touches in a minute of resting at the tube's end, which it comes to
};

/// Expected number of touches while the centre moves along the tube, from entry `from` to its last (5.3-2 to 5.3-4).
/// The error has the covariance of the loop's own recursion under s_k = (w̄_k − mean)/κ of the tube's entries and
/// correlation e^{−|τ|/τ_w}; mean push, first set, body, estimation and `apart` (m) are taken off the clearance in
/// full. What is not free is an obstacle. Ends as soon as it is above `enough`; infinite for a centre or bound that is
/// not finite. O(entries) and, where the distance is below 6 deviations, O((reach/a)³) voxels. Errors: throws
/// std::invalid_argument for κ = 0, tau_w ≤ 0, an integrator and Loop::sampled.
Risk risk_of_touching(const Reachability& reach, const map::OccupancyGrid& grid, const map::DistanceField& distance,
                      const BoundModel& model, const ReachTube& tube,
                      double enough = std::numeric_limits<double>::infinity(), std::size_t from = 0, double apart = 0);

}  // namespace backwash::reach
