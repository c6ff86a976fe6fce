// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/spline/bspline.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>

namespace backwash::plan {

BSplineWeights weights(std::size_t control_points, double knot_span, double t, int order) noexcept {
  const std::size_t segments = control_points - 3;
  const double s = std::clamp(t / knot_span, 0.0, static_cast<double>(segments));
  const std::size_t first = std::min(static_cast<std::size_t>(s), segments - 1);
  const double u = s - static_cast<double>(first), w = 1 - u, d = 1 / knot_span;
  switch (order) {
    case 0:
      return {first,
              {w * w * w / 6, (3 * u * u * u - 6 * u * u + 4) / 6, (-3 * u * u * u + 3 * u * u + 3 * u + 1) / 6,
               u * u * u / 6}};
    case 1:
      return {first, {-w * w / 2 * d, (3 * u * u - 4 * u) / 2 * d, (-3 * u * u + 2 * u + 1) / 2 * d, u * u / 2 * d}};
    case 2:
      return {first, {w * d * d, (3 * u - 2) * d * d, (1 - 3 * u) * d * d, u * d * d}};
    default:
      return {first, {-d * d * d, 3 * d * d * d, -3 * d * d * d, d * d * d}};
  }
}

double BSpline::duration() const noexcept { return static_cast<double>(control_points.size() - 3) * knot_span; }

Vec3 BSpline::derivative(double t, int order) const noexcept {
  const auto [first, w] = weights(control_points.size(), knot_span, t, order);
  return w[0] * control_points[first] + w[1] * control_points[first + 1] + w[2] * control_points[first + 2] +
         w[3] * control_points[first + 3];
}

Setpoint BSpline::at(double t) const noexcept {
  Setpoint s;
  s.p_W = derivative(t, 0);
  if (t < duration()) {
    s.v_W = derivative(t, 1);
    s.a_W = derivative(t, 2);
  }
  return s;
}

std::vector<Setpoint> BSpline::commands() const {
  // The tolerance keeps rounding from adding a command when the duration is a whole number of periods.
  const auto count = static_cast<std::size_t>(std::ceil(duration() / kControlPeriod - 1e-9)) + 1;
  std::vector<Setpoint> result;
  result.reserve(count);
  for (std::size_t k = 0; k + 1 < count; ++k) result.push_back(at(static_cast<double>(k) * kControlPeriod));
  result.push_back(at(duration()));
  return result;
}

std::vector<Vec3> BSpline::velocity_points() const {
  std::vector<Vec3> v;
  for (std::size_t i = 0; i + 1 < control_points.size(); ++i)
    v.push_back((control_points[i + 1] - control_points[i]) / knot_span);
  return v;
}

std::vector<Vec3> BSpline::acceleration_points() const {
  std::vector<Vec3> a;
  for (std::size_t i = 0; i + 2 < control_points.size(); ++i)
    a.push_back((control_points[i + 2] - 2 * control_points[i + 1] + control_points[i]) / (knot_span * knot_span));
  return a;
}

double BSpline::jerk2() const noexcept {
  double sum = 0;
  for (std::size_t i = 0; i + 3 < control_points.size(); ++i)
    sum += (control_points[i + 3] - 3 * control_points[i + 2] + 3 * control_points[i + 1] - control_points[i])
               .squaredNorm();
  return sum / std::pow(knot_span, 5);
}

std::array<Vec3, 3> end_control_points(const Vec3& p, const Vec3& v, const Vec3& a, double knot_span) noexcept {
  const Vec3 middle = p - knot_span * knot_span / 6 * a;
  const Vec3 bend = knot_span * knot_span / 2 * a;
  return {middle - knot_span * v + bend, middle, middle + knot_span * v + bend};
}

namespace {

std::vector<Vec3> subdivided(const std::vector<Vec3>& samples, std::size_t parts) {
  std::vector<Vec3> fine;
  for (std::size_t i = 0; i + 1 < samples.size(); ++i)
    for (std::size_t k = 0; k < parts; ++k)
      fine.push_back(samples[i] + static_cast<double>(k) / static_cast<double>(parts) * (samples[i + 1] - samples[i]));
  fine.push_back(samples.back());
  return fine;
}

}  // namespace

BSpline fit(const std::vector<Vec3>& samples, double knot_span, const Vec3& v_start, const Vec3& a_start,
            const Vec3& v_end, const Vec3& a_end) {
  assert(samples.size() >= 2 && knot_span > 0);
  if (samples.size() < 4) {
    const std::size_t parts = samples.size() == 2 ? 3 : 2;
    return fit(subdivided(samples, parts), knot_span / static_cast<double>(parts), v_start, a_start, v_end, a_end);
  }
  const std::size_t n = samples.size() + 2;
  BSpline spline{std::vector<Vec3>(n, Vec3::Zero()), knot_span};
  auto& q = spline.control_points;
  std::ranges::copy(end_control_points(samples.front(), v_start, a_start, knot_span), q.begin());
  std::ranges::copy(end_control_points(samples.back(), v_end, a_end, knot_span), q.end() - 3);
  if (n == 6) return spline;

  // Interior samples: (q_i + 4 q_{i+1} + q_{i+2})/6 = sample i, the known control points moved to the right.
  const auto unknown = static_cast<Eigen::Index>(n - 6), rows = static_cast<Eigen::Index>(samples.size() - 2);
  Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(rows, unknown);
  Eigen::MatrixX3d right(rows, 3);
  for (Eigen::Index row = 0; row < rows; ++row) {
    right.row(row) = samples[static_cast<std::size_t>(row) + 1].transpose();
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double weight = k == 1 ? 4.0 / 6 : 1.0 / 6;
      const Eigen::Index column = row + 1 + k - 3;  // control point row + 1 + k, the first three are known
      if (column >= 0 && column < unknown)
        basis(row, column) = weight;
      else
        right.row(row) -= weight * q[static_cast<std::size_t>(row + 1 + k)].transpose();
    }
  }
  const Eigen::MatrixX3d solution = (basis.transpose() * basis).ldlt().solve(basis.transpose() * right);
  for (Eigen::Index i = 0; i < unknown; ++i) q[static_cast<std::size_t>(i) + 3] = solution.row(i).transpose();
  return spline;
}

}  // namespace backwash::plan
