// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/plan/spline/bspline.hpp"
#include "core/reach/response/error_dynamics.hpp"

namespace backwash::plan {

/// How the predicted motion depends on the control points, at samples `stride` periods apart (sample m after
/// (m + 1)·stride commands): position(m) = position⁰(m) + Σ_i P(m, i)·(q_i − q_i⁰), velocity alike with V; i runs over
/// the free control points (all but the first and last three). One pair for x and y, one for z.
struct MotionBasis {
  Eigen::MatrixXd P_horizontal, P_vertical;  ///< samples × free control points
  Eigen::MatrixXd V_horizontal, V_vertical;  ///< 1/s
};

/// Response of the predicted motion (reach::CentrePredictor) to the commands. The prediction is linear and
/// time-invariant in them, through r = k_p p_cmd + k_d v_cmd + a_cmd per axis: its response to one unit of r, read off
/// the predictor itself so that the two cannot drift apart, says all, whatever the delays.
class CentreResponse {
 public:
  /// Some thousand steps of the predictor: once per vehicle.
  CentreResponse(const Vehicle& vehicle, reach::Loop loop);

  /// Basis for a spline with `control_points` points (≥ 6). O(free points × samples they move × periods per knot).
  MotionBasis basis(std::size_t control_points, double knot_span, std::size_t samples, std::size_t stride) const;

 private:
  struct Axis {
    double kp, kd;
    std::vector<double> position, velocity;  // k + 1 periods after a command with r = 1, s² and s
  };
  void add(const Axis& axis, std::size_t point, std::size_t control_points, double knot_span, std::size_t stride,
           Eigen::MatrixXd& P, Eigen::MatrixXd& V) const;
  Axis horizontal_, vertical_;
};

}  // namespace backwash::plan
