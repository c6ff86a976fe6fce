// SPDX-License-Identifier: BSD-3-Clause
#include "core/adapt/remainder.hpp"

#include <Eigen/LU>
#include <cmath>

namespace backwash::adapt {

ErrorSample Remainder::add(const ErrorSample& sample) noexcept {
  ErrorSample left = sample;
  for (int k = 0; k < 3; ++k) {
    Axis& axis = axes_[static_cast<std::size_t>(k)];
    Eigen::Vector4d x = Eigen::Vector4d::Zero();
    x[0] = 1;
    for (int i = 1; i < parts_; ++i) x[i] = sample.motion[static_cast<std::size_t>(i - 1)][k];
    const double variance = sample.promised[k] + sample.noise[k];
    const Eigen::Vector4d Px = axis.P * x;
    const double spread = x.dot(Px) / variance, e = sample.e_W[k] - x.dot(axis.theta);
    left.e_W[k] = e;
    left.promised[k] *= 1 + spread;
    left.noise[k] *= 1 + spread;
    const double gain = 1 / (variance * (1 + spread));
    axis.theta += gain * e * Px;
    axis.P -= gain * Px * Px.transpose();
    moved_ += std::pow(x[3] / kp_[k], 2) / variance;
  }
  return left;
}

double Remainder::shown(double v) const noexcept {
  double sum = 0;
  for (const Axis& axis : axes_) {
    const Eigen::Vector3d theta = axis.theta.tail<3>();
    sum += theta.dot(Mat3(axis.P.bottomRightCorner<3, 3>()).inverse() * theta) / v;
  }
  return sum;
}

}  // namespace backwash::adapt
