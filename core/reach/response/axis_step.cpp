// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/response/axis_step.hpp"

#include <unsupported/Eigen/MatrixFunctions>

namespace backwash::reach {

AxisStep axis_step(const AxisLoop& axis, bool closed, double h) {
  using Mat7 = Eigen::Matrix<double, 7, 7>;
  const bool lag = axis.attitude_lag > 0;
  Eigen::Matrix<double, 1, 7> acting = Eigen::Matrix<double, 1, 7>::Zero();  // what the acceleration follows
  acting(3) = 1;
  if (closed) {
    acting(0) = -axis.kp;
    acting(1) = -axis.kd;
  }

  Mat7 M = Mat7::Zero();  // (p, v, a, u, u̇, ü, u⃛)
  M(0, 1) = 1;
  if (lag) {
    M(1, 2) = 1;
    M.row(2) = acting / axis.attitude_lag;
    M(2, 2) -= 1 / axis.attitude_lag;
  } else {
    M.row(1) = acting;
  }
  M(3, 4) = M(4, 5) = M(5, 6) = 1;
  Mat7 T = (M * h).exp();
  if (!lag) T.row(2) = (acting * T).eval();
  return {T.topLeftCorner<3, 3>(), T.topRightCorner<3, 4>()};
}

Eigen::Vector4d cubic_through(double u0, double du0, double u1, double du1, double h) {
  const double slope = (u1 - u0) / h;
  return {u0, du0, 2 * (3 * slope - 2 * du0 - du1) / h, 6 * (du0 + du1 - 2 * slope) / (h * h)};
}

}  // namespace backwash::reach
