// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "core/reach/error_dynamics.hpp"

namespace backwash::plan {

/// Adjoint of the predicted motion (reach::CentrePredictor). The prediction is linear and time-invariant in the
/// commands, through r = k_p p_cmd + k_d v_cmd + a_cmd per axis; its response to one unit of r, read off the predictor
/// itself so that the two cannot drift apart, is therefore all that gradients need, whatever the delays.
class CentreAdjoint {
 public:
  CentreAdjoint(const Vehicle& vehicle, reach::Loop loop);

  /// Sensitivity of a scalar to the commands.
  struct CommandGradient {
    std::vector<Vec3> p, v, a;  ///< ∂f/∂p_cmd, ∂f/∂v_cmd, ∂f/∂a_cmd of each command
  };
  /// `by_position[k]`, `by_velocity[k]`: ∂f/∂ of the predicted position and velocity after k + 1 commands; as many as
  /// there are commands. O(steps that are not zero × length of the response).
  CommandGradient pull_back(std::span<const Vec3> by_position, std::span<const Vec3> by_velocity) const;

 private:
  Vec3 kp_, kd_;
  std::vector<Vec3> position_, velocity_;  // per axis, k + 1 periods after a command with r = 1, s² and s
};

}  // namespace backwash::plan
