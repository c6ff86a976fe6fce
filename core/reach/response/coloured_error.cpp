// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/response/coloured_error.hpp"

#include <numbers>
#include <stdexcept>
#include <unsupported/Eigen/MatrixFunctions>

#include "core/reach/response/response_builder.hpp"

namespace backwash::reach {
namespace {

constexpr int kAll = ColouredStep::kStates + 1;  // the states and ξ
using MatrixAll = Eigen::Matrix<double, kAll, kAll>;

/// d/dt (p, v, a, z_1, z_2, ξ) for s = 1. Delay in units of itself: δż_1 = z_2, δż_2 = −12 z_1 − 6 z_2 + u, and the
/// delayed input is u − 12 z_2. States that a loop has not got decay by themselves.
MatrixAll generator(const AxisLoop& axis, double tau_w) {
  enum { p, v, a, z1, z2, xi };
  Eigen::Matrix<double, 1, kAll> u = Eigen::Matrix<double, 1, kAll>::Zero();
  u[p] = -axis.kp;
  u[v] = -axis.kd;
  Eigen::Matrix<double, 1, kAll> acting = u;
  MatrixAll A = MatrixAll::Zero();
  A(p, v) = 1;
  if (axis.feedback_delay > 0) {
    A(z1, z2) = 1 / axis.feedback_delay;
    A.row(z2) = u / axis.feedback_delay;
    A(z2, z1) -= 12 / axis.feedback_delay;
    A(z2, z2) -= 6 / axis.feedback_delay;
    acting[z2] -= 12;
  } else {
    A(z1, z1) = A(z2, z2) = -1;
  }
  if (axis.attitude_lag > 0) {
    A(v, a) = 1;
    A.row(a) = acting / axis.attitude_lag;
    A(a, a) -= 1 / axis.attitude_lag;
  } else {
    A.row(v) = acting;
    A(a, a) = -1;
  }
  A(v, xi) += 1;
  A(xi, xi) = -1 / tau_w;
  return A;
}

}  // namespace

ColouredStep::ColouredStep(const AxisLoop& loop, double tau_w, double step) : axis(loop), period(step) {
  if (!(tau_w > 0)) throw std::invalid_argument("chance-constrained sets need a correlation time tau_w above 0");
  if (axis.feedback_delay > 0) axis.feedback_delay = std::max(axis.feedback_delay, kMinFeedbackDelay);
  const MatrixAll A = generator(axis, tau_w);
  const MatrixAll whole = (A * period).exp();
  // ∫₀^h e^{Aτ}BBᵀe^{Aᵀτ} dτ by Simpson's rule over h/2^k, then doubled: stable for the fast states of short delays,
  // where exp(−A h) of the usual block exponential overflows.
  constexpr int kDoublings = 14;
  double h = std::ldexp(period, -kDoublings);
  const auto shape = [&](double at) -> MatrixAll {
    const Eigen::Matrix<double, kAll, 1> b = std::sqrt(2 / tau_w) * (A * at).exp().col(kAll - 1);
    return b * b.transpose();
  };
  MatrixAll N = h / 6 * (shape(0) + 4 * shape(h / 2) + shape(h));
  for (int i = 0; i < kDoublings; ++i, h *= 2) {
    const MatrixAll half = (A * h).exp();
    N += (half * N * half.transpose()).eval();
  }
  E = whole.topLeftCorner<kStates, kStates>();
  g = whole.topRightCorner<kStates, 1>();
  rho = whole(kStates, kStates);
  noise = N.topLeftCorner<kStates, kStates>();
  noise_to_xi = N.topRightCorner<kStates, 1>();
}

// Σ_k A^k N A^kᵀ, doubled.
SteadyError steady_error(const ColouredStep& step, double below) {
  MatrixAll A = MatrixAll::Zero(), P;
  A << step.E, step.g, Eigen::RowVectorXd::Zero(kAll - 1), step.rho;
  P << step.noise, step.noise_to_xi, step.noise_to_xi.transpose(), 1 - step.rho * step.rho;
  MatrixAll power = A;
  for (int k = 0; k < 24; ++k) {
    P += (power * P * power.transpose()).eval();
    power = (power * power).eval();
  }
  constexpr double kLongest = 120;                     // s
  Eigen::Matrix<double, kAll, 1> with_now = P.col(0);  // covariance of the states with e of before
  int memory = 0;
  for (int k = 0; k * step.period < kLongest; ++k, with_now = (A * with_now).eval())
    if (std::abs(with_now[0]) >= below * P(0, 0)) memory = k + 1;
  return {P(0, 0), memory * step.period};
}

double ErrorCovariance::turn_rate() const noexcept {
  if (!(P_(0, 0) > 0)) return 0;
  const double rest = P_(1, 1) - P_(0, 1) * P_(0, 1) / P_(0, 0);
  return std::sqrt(std::max(0.0, rest) / P_(0, 0));
}

// |ë| ≤ |a| + |w| with a the state, or the feedback itself: triangle inequality of deviations.
double ErrorCovariance::acceleration_deviation(double s) const noexcept {
  const auto& axis = step_->axis;
  const auto deviation = [&](int i) { return std::sqrt(std::max(0.0, P_(i, i))); };
  if (axis.attitude_lag > 0) return deviation(2) + s;
  return axis.kp * deviation(0) + axis.kd * deviation(1) + (axis.feedback_delay > 0 ? 12 * deviation(4) : 0.0) + s;
}

void ErrorCovariance::advance(double s) noexcept {
  const ColouredStep& m = *step_;
  const double before = position_deviation(), rate_before = turn_rate(), bend_before = acceleration_deviation(s);
  const double with_before = m.E.row(0) * P_.col(0) + s * m.g[0] * P_xi_[0];
  const ColouredStep::Vector carried = m.E * P_xi_;
  const ColouredStep::Matrix cross = s * carried * m.g.transpose();
  P_ = (m.E * P_ * m.E.transpose() + cross + cross.transpose() + s * s * (m.g * m.g.transpose() + m.noise)).eval();
  P_xi_ = m.rho * (carried + s * m.g) + s * m.noise_to_xi;

  const double after = position_deviation();
  started_ = before == 0 && after > 0;
  if (started_) {
    turned_ = 2 * m.period * turn_rate();  // the rate falls like 1/√t from the start
  } else {
    // Where σ_e almost vanishes the rate is a spike that the trapezoid may miss; the angle between e before and after,
    // seen as vectors, is not.
    const double cosine = before * after > 0 ? std::clamp(with_before / (before * after), -1.0, 1.0) : 1.0;
    turned_ = std::max(m.period / 2 * (rate_before + turn_rate()), std::acos(cosine));
  }
  // A chord's error, δ²/8·|ë|, with |ë| of both ends doubled for what it does in between.
  const double bend = 2 * std::max(bend_before, acceleration_deviation(s));
  largest_ = std::max(before, after) + m.period * m.period / 8 * bend;
}

double exit_level(double turned, double level_before, double probability) {
  const double outside_before = std::erfc(level_before / std::numbers::sqrt2);
  const auto exits = [&](double level) {
    return turned / std::numbers::pi * std::exp(-level * level / 2) +
           std::max(0.0, std::erfc(level / std::numbers::sqrt2) - outside_before);
  };
  double low = 0, high = 38;  // e^{−38²/2} is the smallest double
  if (exits(low) <= probability) return low;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (exits(middle) <= probability ? high : low) = middle;
  }
  return high;
}

}  // namespace backwash::reach
