// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "core/reach/error_dynamics.hpp"

namespace backwash::plan {

/// Adjoint of the predicted motion (reach::CentrePredictor). The prediction is linear in the commands: with
/// r = k_p p_cmd + k_d v_cmd + a_cmd per axis, x_{k+1} = A x_k + Σ_i B_i r_{k−i}, x = (p, v, a). A and the B_i are read
/// off the predictor itself by unit states and one unit command, so the two cannot drift apart.
class CentreAdjoint {
 public:
  CentreAdjoint(const Vehicle& vehicle, reach::Loop loop);

  /// Sensitivity of a scalar to the commands.
  struct CommandGradient {
    std::vector<Vec3> p, v, a;  ///< ∂f/∂p_cmd, ∂f/∂v_cmd, ∂f/∂a_cmd of each command
  };
  /// `by_position[k]`, `by_velocity[k]`: ∂f/∂ of the predicted position and velocity after k + 1 commands; as many as
  /// there are commands. O(commands).
  CommandGradient pull_back(std::span<const Vec3> by_position, std::span<const Vec3> by_velocity) const;

 private:
  struct Axis {
    Eigen::Matrix3d A;
    std::vector<Eigen::Vector3d> B;  ///< B_i, newest command first
    double kp, kd;
  };
  static Axis identify(const Vehicle& vehicle, reach::Loop loop, int axis);
  Axis horizontal_, vertical_;
};

}  // namespace backwash::plan
