// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <vector>

#include "core/reach/response/error_dynamics.hpp"

namespace backwash::reach {

inline constexpr double kRolloutStep = 2e-3;  ///< s
inline constexpr int kRolloutSteps = 10;      ///< in a control period

/// Independent oracle: many motions of one axis at once by the classical Runge–Kutta method of order 4,
///   ṗ = v, v̇ = a + w, lag·ȧ = u − a, u = r − k_p p(t − delay) − k_d v(t − delay),
/// with w and r constant in a step. The delay and 20 ms must be multiples of the step h. `sampled`: the feedback part
/// of u is computed every 20 ms and held. For t < 0, p and v are those at 0.
class AxisRollouts {
 public:
  using Batch = Eigen::ArrayXd;  // one entry per motion

  AxisRollouts(const AxisLoop& axis, bool sampled, double h, const Batch& p, const Batch& v)
      : AxisRollouts(axis, sampled, h, p, v, Batch::Zero(p.size())) {}
  AxisRollouts(const AxisLoop& axis, bool sampled, double h, const Batch& p, const Batch& v, const Batch& a)
      : axis_(axis),
        sampled_(sampled),
        h_(h),
        delay_(static_cast<std::size_t>(std::lround(axis.feedback_delay / h))),
        p_(p),
        v_(v),
        a_(a),
        before_(feedback(p, v)) {}

  const Batch& p() const { return p_; }
  const Batch& v() const { return v_; }
  const Batch& a() const { return a_; }

  /// Moves on by h.
  void step(const Batch& w) { step(w, Batch::Zero(w.size())); }
  void step(const Batch& w, const Batch& r) {
    const auto per_sample = static_cast<std::size_t>(std::lround(kControlPeriod / h_));
    const std::size_t i = past_.size();
    if (sampled_ && i % per_sample == 0)
      held_ = delay_ == 0 ? feedback(p_, v_) : i < delay_ ? before_ : past_[i - delay_].start;

    // The input at one of the three instants of the step, 0: start, 1: middle, 2: end.
    const auto input = [&](int instant, const Batch& p, const Batch& v) -> Batch {
      if (sampled_) return r + held_;
      if (delay_ == 0) return r + feedback(p, v);
      if (i < delay_) return r + before_;
      const Past& past = past_[i - delay_];
      return r + (instant == 0 ? past.start : instant == 1 ? past.middle : past.end);
    };
    const double lag = axis_.attitude_lag;
    const auto slope = [&](int instant, const Batch& p, const Batch& v, const Batch& a) -> Slope {
      const Batch u = input(instant, p, v);
      if (lag <= 0) return {v, u + w, Batch::Zero(p.size())};
      return {v, a + w, (u - a) / lag};
    };
    const Slope k1 = slope(0, p_, v_, a_);
    const Slope k2 = slope(1, p_ + h_ / 2 * k1.p, v_ + h_ / 2 * k1.v, a_ + h_ / 2 * k1.a);
    const Slope k3 = slope(1, p_ + h_ / 2 * k2.p, v_ + h_ / 2 * k2.v, a_ + h_ / 2 * k2.a);
    const Slope k4 = slope(2, p_ + h_ * k3.p, v_ + h_ * k3.v, a_ + h_ * k3.a);
    const Batch p = p_ + h_ / 6 * (k1.p + 2 * k2.p + 2 * k3.p + k4.p);
    const Batch v = v_ + h_ / 6 * (k1.v + 2 * k2.v + 2 * k3.v + k4.v);
    const Batch a = lag > 0 ? Batch(a_ + h_ / 6 * (k1.a + 2 * k2.a + 2 * k3.a + k4.a)) : input(2, p, v);
    const Batch middle_p = (p_ + p) / 2 + h_ / 8 * (v_ - v);
    const Batch middle_v = (v_ + v) / 2 + h_ / 8 * (k1.v - slope(2, p, v, a).v);
    past_.push_back({feedback(p_, v_), feedback(middle_p, middle_v), feedback(p, v)});
    p_ = p;
    v_ = v;
    a_ = a;
  }

 private:
  struct Slope {
    Batch p, v, a;
  };
  struct Past {  // feedback over a past step
    Batch start, middle, end;
  };
  Batch feedback(const Batch& p, const Batch& v) const { return -axis_.kp * p - axis_.kd * v; }

  AxisLoop axis_;
  bool sampled_;
  double h_;
  std::size_t delay_;
  Batch p_, v_, a_;
  Batch before_, held_;
  std::vector<Past> past_;
};

/// The gain sets of the tests: PX4's defaults, the paper's region, critically damped, overdamped, barely damped.
inline constexpr double kGainSets[][2] = {{1.71, 1.8}, {6, 4}, {16, 8}, {6, 8}, {20, 4}};

}  // namespace backwash::reach
