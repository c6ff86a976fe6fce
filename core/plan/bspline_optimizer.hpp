// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/map/distance_field.hpp"
#include "core/plan/bspline.hpp"
#include "core/plan/centre_adjoint.hpp"
#include "core/plan/kinodynamic_astar.hpp"

namespace backwash::plan {

/// Where the predicted motion starts: the estimated state, its acceleration and the command active now.
struct PlanStart {
  State estimated;
  Setpoint command;
};

/// Weights of f = λ_s f_s + λ_c f_c + λ_p f_p (paper Sec. V-B). λ_c ≫ λ_s, λ_p.
struct CostWeights {
  double smooth = 1;        ///< λ_s, 1/m²
  double collision = 2000;  ///< λ_c, 1/m³
  double physical = 0.2;    ///< λ_p, s⁴/m⁴ and s⁸/m⁴
};

/// The cost of a spline as a function of its interior control points (the first and last three are the end conditions).
///   f_s = Σ ‖−q_i + 3q_{i+1} − 3q_{i+2} + q_{i+3}‖²
///   f_c = Σ_k (d(p_p(τ_k)) − r_k)² [d ≤ r_k] ‖v_p(τ_k)‖ δt, p_p, v_p the motion predicted under the held commands
///   f_p = Σ (V² − v_max²)² [V² > v_max²] + the same for accelerations, over control points and axes
class SplineCost {
 public:
  /// `keep_away[k]`: r_k of the step that starts at k·20 ms, as the stored distance must show it, m; held while
  /// optimising. Its size is that of the tube, commands + 1 (holding the end included); `v_limit`, `a_limit` per axis.
  SplineCost(const map::DistanceField& distance, const Vehicle& vehicle, reach::Loop loop, const PlanStart& start,
             const BSpline& spline, std::vector<double> keep_away, const Vec3& v_limit, const Vec3& a_limit,
             const CostWeights& weights);

  struct Value {
    double f;
    std::vector<double> gradient;  ///< by interior control points, x, y, z of each in turn
  };
  std::size_t variables() const noexcept { return 3 * (initial_.control_points.size() - 6); }
  std::vector<double> start_point() const;
  BSpline spline_at(std::span<const double> x) const;
  /// f and its exact gradient (adjoint). O(commands + control points).
  Value operator()(std::span<const double> x) const;

 private:
  struct PointCost {
    double f;
    std::vector<Vec3> gradient;  ///< by all control points
  };
  PointCost smoothness(const BSpline& spline) const;
  PointCost limits(const BSpline& spline) const;
  PointCost collision(const BSpline& spline) const;

  const map::DistanceField& distance_;
  const Vehicle& vehicle_;
  reach::Loop loop_;
  CentreAdjoint adjoint_;
  PlanStart start_;
  BSpline initial_;
  std::vector<double> keep_away_;
  Vec3 v_limit_, a_limit_;
  CostWeights weights_;
};

struct OptimizerResult {
  BSpline spline;
  double cost;  ///< f of the best point seen
  std::size_t evaluations;
};
/// Minimises by NLopt's L-BFGS from the initial spline, f scaled so that |g_0|_∞ = 0.1, until it converges,
/// `max_evaluations` or the deadline. Never worse than the start.
OptimizerResult optimise(const SplineCost& cost, std::size_t max_evaluations, Clock::time_point deadline);

}  // namespace backwash::plan
