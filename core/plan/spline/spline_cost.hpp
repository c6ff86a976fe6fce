// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "core/plan/spline/bspline.hpp"
#include "core/plan/spline/centre_response.hpp"
#include "core/plan/world/world.hpp"

namespace backwash::plan {

/// Weights of f = λ_s f_s + λ_c f_c + λ_p f_p (paper Sec. V-B). λ_c ≫ λ_s, λ_p.
struct CostWeights {
  double smooth = 10;       ///< λ_s, 1/m²
  double collision = 2000;  ///< λ_c, 1/m³
  double physical = 0.2;    ///< λ_p, s⁴/m⁴ and s⁸/m⁴
};

/// Limits per axis of a trajectory. A start above them must slow down: what it may have falls by a quarter of the
/// largest acceleration, and the cost asks for it from the first free control point on.
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

/// Bound w̄ between voxel centres, m/s², and its gradient by position: trilinear, the weights of the stored voxels
/// renormalised; zero where none is stored.
struct LocalBound {
  PerDirection w{};
  Eigen::Matrix<double, 3, kDirections> gradient = Eigen::Matrix<double, 3, kDirections>::Zero();  ///< 1/s²
};
LocalBound interpolated(const map::OccupancyGrid& grid, const reach::BoundField& bounds, const Vec3& p_W) noexcept;

/// The cost of a spline as a function of its free control points (the first and last three are the end conditions).
///   f_s = Σ ‖−q_i + 3q_{i+1} − 3q_{i+2} + q_{i+3}‖²
///   f_c = Σ_m lack_m² [lack_m > 0] ‖v_p(τ_m)‖ δτ,   p_p, v_p the motion predicted under the held commands
///   f_p = Σ (V² − v_max²)² [V² > v_max²] + the same for accelerations, over control points and axes
/// lack is docs/model.md's r − d, written about the tube that the spline was verified with last:
///   lack_m = margin − (c_m + d(p_p) − d(p_p⁰) − Δe_m),
/// c_m the exact clearance of that tube's swept prism (its own ten faces, not ‖h‖₂), d the interpolated distance, and
///   Δe_m = Σ_n k_n Σ_{j<m} G_{m−1−j} (w̄_n(p_p(τ_j)) − w̄_n(p_p⁰(τ_j)))
/// what the set's support towards the nearest obstacle grows by as the motion moves through the disturbance field: k
/// the weights of the directions that enclose the obstacle's, held while optimising. Samples are about a voxel of
/// flight apart; what lies between is for the verification.
class SplineCost {
 public:
  /// `tube`: of `spline`'s commands in the world, with at least those followed by the hold. `margin`: clearance to
  /// keep, m. `norm`: ‖h‖₂ instead, the paper's r, in c_m = d(p_p⁰) − ‖h‖₂ as in Δe_m. Precondition: at least 6 control
  /// points (then none is free).
  SplineCost(const World& world, const BSpline& spline, const reach::ReachTube& tube, double margin,
             const MotionLimits& limits, const CostWeights& weights, bool norm = false);

  /// Free control points, one row each.
  using Points = Eigen::Matrix<double, Eigen::Dynamic, 3>;
  struct Value {
    double f;
    Points gradient;  ///< exact, the dependence of the set on the motion through the field included
  };
  Points start_point() const;
  BSpline spline_at(const Points& points) const;
  /// O(samples × free control points).
  Value operator()(const Points& points) const;

 private:
  struct Sample {
    Vec3 p, v;         // predicted by the tube
    double clearance;  // of the tube's set there, less margin, m
    double distance;   // interpolated at p, m
    PerDirection k;    // weights of the directions in the support towards the obstacle
    PerDirection w;    // interpolated bound at p
  };
  double smoothness(const Points& q, Points& gradient) const;
  double limits(const Points& q, Points& gradient) const;
  double collision(const Points& moved, Points& gradient) const;
  void grow(const std::vector<Vec3>& p, const std::vector<std::size_t>& near, std::vector<double>& lack,
            std::vector<LocalBound>& local) const;
  Sample sample(const reach::ReachTube& tube, std::size_t k, double margin) const;

  const World& world_;
  BSpline initial_;
  Points v_limits_;  // of the velocity control points
  Vec3 a_limit_;
  CostWeights weights_;
  bool norm_;
  std::size_t stride_;
  MotionBasis basis_;
  std::vector<Sample> samples_;
  std::vector<double> G_horizontal_, G_vertical_;  // per interval between samples, s²; empty: the set is fixed
};

}  // namespace backwash::plan
