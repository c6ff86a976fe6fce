// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/ellipsoid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <unsupported/Eigen/MatrixFunctions>

namespace backwash::reach {
namespace {

using Eigen::Matrix2d;
using Blocks = std::array<Matrix2d, 3>;

Matrix2d error_matrix(double kp, double kd) { return (Matrix2d() << 0, 1, -kp, -kd).finished(); }

double trace(const Blocks& Q) { return Q[0].trace() + Q[1].trace() + Q[2].trace(); }

// Q_d = (Σ_i √tr Q_i)(Σ_i Q_i/√tr Q_i) with Q_i = dt w̄_i² X_i + ε dt² I.
Blocks step_shape(const Blocks& X, const Vec3& w_bar) {
  constexpr double dt = kControlPeriod, floor = EllipsoidRecursion::kEpsilon * dt * dt;
  Blocks Q_d{Matrix2d::Zero(), Matrix2d::Zero(), Matrix2d::Zero()};
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Matrix2d Q_i = dt * w_bar[static_cast<Eigen::Index>(i)] * w_bar[static_cast<Eigen::Index>(i)] * X[i];
    const double root = std::sqrt(Q_i.trace() + 6 * floor);
    if (root == 0) continue;  // Q_i/√tr Q_i → 0
    sum += root;
    Q_d[i] += Q_i / root;
    for (Matrix2d& block : Q_d) block += floor / root * Matrix2d::Identity();
  }
  for (Matrix2d& block : Q_d) block *= sum;
  return Q_d;
}

// Symmetric 2×2 solution of Q = s E Q Eᵀ + C.
Matrix2d discrete_lyapunov(const Matrix2d& E, double s, const Matrix2d& C) {
  const double a = E(0, 0), b = E(0, 1), c = E(1, 0), d = E(1, 1);
  Mat3 M;  // acting on (Q_pp, Q_pv, Q_vv)
  M << a * a, 2 * a * b, b * b, a * c, a * d + b * c, b * d, c * c, 2 * c * d, d * d;
  const Vec3 q = (Mat3::Identity() - s * M).inverse() * Vec3(C(0, 0), C(0, 1), C(1, 1));
  return (Matrix2d() << q[0], q[1], q[1], q[2]).finished();
}

// The larger real part of the roots of s² + k_d s + k_p.
double slowest_root(double kp, double kd) {
  const double under_root = kd * kd / 4 - kp;
  return -kd / 2 + (under_root > 0 ? std::sqrt(under_root) : 0.0);
}

struct Axis {
  Matrix2d transition, X;
};
Axis axis_of(double kp, double kd) { return {(error_matrix(kp, kd) * kControlPeriod).exp(), step_gramian(kp, kd)}; }

/// Last of 0 … high at which a growing function is below a value, to high/2⁵⁰: bisection.
template <typename F>
double last_below(double value, double high, F growing) {
  double low = 0;
  for (int i = 0; i < 50; ++i) {
    const double middle = (low + high) / 2;
    (growing(middle) < value ? low : high) = middle;
  }
  return low;
}

}  // namespace

Matrix2d step_gramian(double kp, double kd) {
  // Van Loan: exp(dt (Φ, DDᵀ; 0, −Φᵀ)) = (·, e^{Φdt}X; 0, e^{−Φᵀdt}).
  const Matrix2d Phi = error_matrix(kp, kd);
  Eigen::Matrix4d M = Eigen::Matrix4d::Zero();
  M.topLeftCorner<2, 2>() = Phi;
  M(1, 3) = 1;
  M.bottomRightCorner<2, 2>() = -Phi.transpose();
  const Eigen::Matrix4d T = (M * kControlPeriod).exp();
  const Matrix2d X = T.bottomRightCorner<2, 2>().transpose() * T.topRightCorner<2, 2>();
  return (X + X.transpose()) / 2;
}

EllipsoidRecursion::EllipsoidRecursion(const Vehicle& vehicle) {
  const auto& c = vehicle.controller;
  const Axis h = axis_of(c.kp.horizontal, c.kd.horizontal), v = axis_of(c.kp.vertical, c.kd.vertical);
  transition_ = {h.transition, h.transition, v.transition};
  X_ = {h.X, h.X, v.X};
  const double position = vehicle.initial_error.position, velocity = vehicle.initial_error.velocity;
  Q_.fill((Matrix2d() << position * position, 0, 0, velocity * velocity).finished());
}

void EllipsoidRecursion::step(const Vec3& w_bar) noexcept {
  const Blocks Q_d = step_shape(X_, w_bar);
  const double a = std::sqrt(trace(Q_)), b = std::sqrt(trace(Q_d));
  // (1 + b/a) Q_k vanishes with Q_k, (1 + a/b) Q_d with Q_d.
  const double of_Q = a > 0 ? 1 + b / a : 0, of_Q_d = b > 0 ? 1 + a / b : 0;
  for (std::size_t i = 0; i < 3; ++i)
    Q_[i] = transition_[i] * (of_Q * Q_[i] + of_Q_d * Q_d[i]) * transition_[i].transpose();
}

Mat6 EllipsoidRecursion::Q() const noexcept {
  Mat6 Q = Mat6::Zero();
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index row = 0; row < 2; ++row)
      for (Eigen::Index column = 0; column < 2; ++column)
        Q(i + 3 * row, i + 3 * column) = Q_[static_cast<std::size_t>(i)](row, column);
  return Q;
}

Mat3 EllipsoidRecursion::position_shape() const noexcept {
  return Vec3(Q_[0](0, 0), Q_[1](0, 0), Q_[2](0, 0)).asDiagonal();
}

Mat3 hover_ellipsoid(const Vehicle& vehicle, const Vec3& w_bar) {
  const auto& c = vehicle.controller;
  const double slowest =
      std::max(slowest_root(c.kp.horizontal, c.kd.horizontal), slowest_root(c.kp.vertical, c.kd.vertical));
  if (!(slowest < 0)) throw std::invalid_argument("hover_ellipsoid: the gains k_p and k_d must be positive");
  const Axis h = axis_of(c.kp.horizontal, c.kd.horizontal), v = axis_of(c.kp.vertical, c.kd.vertical);
  const Blocks Q_d = step_shape({h.X, h.X, v.X}, w_bar);
  const double trace_d = trace(Q_d);

  const auto solution = [&](double r) {
    Blocks Q;
    for (std::size_t i = 0; i < 3; ++i) {
      const Matrix2d& E = i < 2 ? h.transition : v.transition;
      Q[i] = discrete_lyapunov(E, 1 + r, (1 + 1 / r) * E * Q_d[i] * E.transpose());
    }
    return Q;
  };
  // r² tr Q(r) grows with r, from 0 to infinity at (1 + r) e^{2 slowest dt} = 1.
  const Blocks Q = solution(last_below(trace_d, std::expm1(-2 * slowest * kControlPeriod),
                                       [&](double r) { return r * r * trace(solution(r)); }));
  constexpr double kRoundUp = 1 + 1e-6;  // covers the root's width
  return kRoundUp * Mat3(Vec3(Q[0](0, 0), Q[1](0, 0), Q[2](0, 0)).asDiagonal());
}

HoverEllipsoid::HoverEllipsoid(const Vehicle& vehicle) : vehicle_(vehicle) {
  const auto& c = vehicle.controller;
  const double slowest =
      std::max(slowest_root(c.kp.horizontal, c.kd.horizontal), slowest_root(c.kp.vertical, c.kd.vertical));
  if (!(slowest < 0)) throw std::invalid_argument("HoverEllipsoid: the gains k_p and k_d must be positive");
  const Axis h = axis_of(c.kp.horizontal, c.kd.horizontal), v = axis_of(c.kp.vertical, c.kd.vertical);
  const double root_h = std::sqrt(kControlPeriod * h.X.trace()), root_v = std::sqrt(kControlPeriod * v.X.trace());
  root_trace_ = {root_h, root_h, root_v};
  // Solution for an axis with tr Q_i = 1.
  const auto solution = [](const Axis& axis, double r) {
    const Matrix2d& E = axis.transition;
    return discrete_lyapunov(E, 1 + r, (1 + 1 / r) / axis.X.trace() * E * axis.X * E.transpose());
  };
  for (int n = 0; n <= kShares; ++n) {
    const double share = std::pow(std::sin(std::numbers::pi / 2 * n / kShares), 2);
    const double at = last_below(1, std::expm1(-2 * slowest * kControlPeriod), [&](double r) {
      return r * r * ((1 - share) * solution(h, r).trace() + share * solution(v, r).trace());
    });
    square_.emplace_back(solution(h, at)(0, 0), solution(v, at)(0, 0));
  }
}

Vec3 HoverEllipsoid::half_axes(const Vec3& w_bar) const {
  const Vec3 root = root_trace_.cwiseProduct(w_bar);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (!(root.sum() < kInfinity)) return Vec3::Constant(kInfinity);  // its share of an axis would be no number
  if (!(w_bar.minCoeff() >= kLeastBound)) return hover_ellipsoid(vehicle_, w_bar).diagonal().cwiseSqrt();
  const double sum = root.sum(), at = std::asin(std::sqrt(root.z() / sum)) * 2 / std::numbers::pi * kShares;
  const auto n = std::min(static_cast<std::size_t>(at), static_cast<std::size_t>(kShares - 1));
  const Eigen::Vector2d u = square_[n] + (at - static_cast<double>(n)) * (square_[n + 1] - square_[n]);
  constexpr double kRoundUp = 1 + 2e-5;  // covers the roots' width and ε
  return (kRoundUp * sum * root.cwiseProduct(Vec3(u[0], u[0], u[1]))).cwiseSqrt();
}

}  // namespace backwash::reach
