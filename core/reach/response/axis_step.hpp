// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace backwash::reach {

/// One axis of the error dynamics: ė_p = e_v, ė_v = a + w, lag·ȧ = u − a, u = −k_p e_p(t − delay) − k_d e_v(t − delay).
struct AxisLoop {
  double kp;              ///< 1/s²
  double kd;              ///< 1/s
  double feedback_delay;  ///< s, ≥ 0
  double attitude_lag;    ///< s, ≥ 0; 0: a = u
  /// Integral gain of the velocity loop, 1/s², ≥ 0. No equation of the sets holds it: what it does joins the bound
  /// (integrator.hpp).
  double velocity_integrator = 0;
};

/// Exact solution of one axis over a time h with x = (p, v, a) and an input u that is a cubic in time:
///   x(h) = E x(0) + F (u, u̇, ü, u⃛)(0).  With lag 0, a is no state: the last row gives the input at h.
struct AxisStep {
  Eigen::Matrix3d E;
  Eigen::Matrix<double, 3, 4> F;
};

/// closed: the input adds to the immediate feedback −k_p p − k_d v; otherwise it is all that acts. `axis`' delay is not
/// looked at. One matrix exponential.
AxisStep axis_step(const AxisLoop& axis, bool closed, double h);

/// u, u̇, ü, u⃛ at 0 of the cubic on [0, h] with the given values and slopes at its ends (cubic Hermite).
Eigen::Vector4d cubic_through(double u0, double du0, double u1, double du1, double h);

}  // namespace backwash::reach
