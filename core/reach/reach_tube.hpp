// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "core/reach/bound/bound_field.hpp"
#include "core/reach/ellipsoid.hpp"
#include "core/reach/response/error_dynamics.hpp"
#include "core/reach/response/integrator.hpp"
#include "core/reach/support.hpp"
#include "core/types/disturbance.hpp"
#include "core/types/state.hpp"

namespace backwash::reach {

enum class Method { tight, paper };

/// One entry of a tube: the set at t = k·0.02 s, after k steps.
struct TubeStep {
  double t;                           ///< s since the tube's start
  State center;                       ///< predicted motion
  DisturbanceBound w_bar;             ///< bound held from here to the next entry (last entry: the last one held)
  PerDirection half_widths;           ///< position error, at t, m (tight: exact; paper: the ellipsoid's support)
  PerDirection half_widths_interval;  ///< valid from t to t + 0.02 s, m
  Mat3 shape;                         ///< paper only: position block of Q, m²; zero for tight
  /// Largest half axis: √λ_max(shape) for paper, ‖(x, y, z)‖₂ of the half widths for tight, m.
  double r_max;
};
using ReachTube = std::vector<TubeStep>;

/// Everything about a vehicle's loop that tubes need, computed once. Errors: throws std::invalid_argument for
/// Loop::sampled with an integrator.
struct Reachability {
  Reachability(const Vehicle& vehicle, Method method = Method::tight, Loop loop = Loop::vehicle);
  Vehicle vehicle;
  Method method;
  Loop loop;
  AxisResponse horizontal, vertical;
  IntegratorResponse horizontal_integrator, vertical_integrator;
};

/// Tube along held commands with the bound given for each step (command k and bound k hold during step k; sizes equal):
/// N commands give N + 1 entries. The centre starts at `start`. `pushes`: mean push of each step, m/s²; none: 0.
ReachTube tube_with_bounds(const Reachability& reach, const State& start, const Setpoint& previous,
                           std::span<const Setpoint> commands, std::span<const DisturbanceBound> bounds,
                           std::span<const Vec3> pushes = {});

/// Tube along held commands through a map: the bound of each step is the maximum over the voxels that the set can reach
/// in that step (hull of the step's two centres ± interval half widths). The mean push of an extended model, at each
/// predicted state, moves the centre, Δc_{k+1} = A Δc_k + B d(c_k, v_k); by how much the push differs over the set
/// joins the bound.
ReachTube tube_over_field(const Reachability& reach, const State& start, const Setpoint& previous,
                          std::span<const Setpoint> commands, const BoundField& bounds);

}  // namespace backwash::reach
