// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/adapt/control_error.hpp"

namespace backwash::adapt {

/// What is left of the errors when a constant part, and then one that follows the commanded motion, is foretold from
/// the samples before (docs/model.md 7-6): weighted least squares, axis by axis, each error by its modelled deviation.
class Remainder {
 public:
  /// A constant alone, or the motion's three parts beside it.
  Remainder(const Vec3& kp, bool motion) : kp_(kp), parts_(motion ? kParts : 1) {
    for (auto& axis : axes_) axis.P.diagonal().setConstant(kBefore * kBefore);
  }
  /// The error less its foretold part; `promised` and `noise` grow by what is not known of that part. Learns it then.
  /// Real-time: wait-free, no allocation.
  ErrorSample add(const ErrorSample& sample) noexcept;
  /// How far the motion's parts are from nothing where the variance is v times the promised one: χ² of nine. Real-time:
  /// wait-free, no allocation.
  double shown(double v) const noexcept;
  /// The same of a loop whose acceleration lags by `lag` s more than its vehicle file says, as it was flown.
  double would_show(double lag, double v) const noexcept { return lag * lag * moved_ / v; }

 private:
  static constexpr int kParts = 4;
  static constexpr double kBefore = 1;  ///< m, s: deviation of what nothing is known of yet
  struct Axis {
    Eigen::Vector4d theta = Eigen::Vector4d::Zero();
    Eigen::Matrix4d P = Eigen::Matrix4d::Zero();  // of theta, per unit of the modelled variance
  };
  Vec3 kp_;
  int parts_;
  std::array<Axis, 3> axes_;
  double moved_ = 0;  // squares of what 1 s of lag adds, over the promised variance
};

}  // namespace backwash::adapt
