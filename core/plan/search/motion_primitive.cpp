// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/search/motion_primitive.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace backwash::plan {

double Motion::effort() const noexcept {
  const double T = duration;
  return 4 * c[2].squaredNorm() * T + 12 * c[2].dot(c[3]) * T * T + 12 * c[3].squaredNorm() * T * T * T;
}

Vec3 Motion::peak_velocity() const noexcept {
  Vec3 peak = velocity(0).cwiseAbs().cwiseMax(velocity(duration).cwiseAbs());
  for (int axis = 0; axis < 3; ++axis) {
    const double t = c[3][axis] != 0 ? -c[2][axis] / (3 * c[3][axis]) : -1;
    if (t > 0 && t < duration) peak[axis] = std::max(peak[axis], std::abs(velocity(t)[axis]));
  }
  return peak;
}

Vec3 Motion::peak_acceleration() const noexcept {
  return acceleration(0).cwiseAbs().cwiseMax(acceleration(duration).cwiseAbs());
}

Box bounds(const Motion& motion, double from, double to) noexcept {
  const Vec3 a = motion.position(from), b = motion.position(to);
  Box box{a.cwiseMin(b), a.cwiseMax(b)};
  for (int axis = 0; axis < 3; ++axis) {
    const auto include = [&](double t) {
      if (!(t > from && t < to)) return;
      const double p = motion.position(t)[axis];
      box.low[axis] = std::min(box.low[axis], p);
      box.high[axis] = std::max(box.high[axis], p);
    };
    // Turning points: c1 + 2 c2 t + 3 c3 t² = 0, in the form that does not cancel.
    const double c1 = motion.c[1][axis], c2 = motion.c[2][axis], c3 = motion.c[3][axis];
    const double discriminant = c2 * c2 - 3 * c3 * c1;
    if (discriminant < 0) continue;
    const double s = -(c2 + std::copysign(std::sqrt(discriminant), c2));
    if (c3 != 0) include(s / (3 * c3));
    if (s != 0) include(c1 / s);
  }
  return box;
}

Motion primitive(const State& from, const Vec3& u, double duration) noexcept {
  return {{from.p_W, from.v_W, u / 2, Vec3::Zero()}, duration};
}

Motion optimal_cubic(const State& from, const Vec3& goal_W, double duration) noexcept {
  const double T = duration;
  const Vec3 d = goal_W - from.p_W - from.v_W * T, dv = -from.v_W;
  const Vec3 alpha = (-12 * d + 6 * T * dv) / (T * T * T);
  const Vec3 beta = (6 * T * d - 2 * T * T * dv) / (T * T * T);
  return {{from.p_W, from.v_W, beta / 2, alpha / 6}, T};
}

namespace {

/// Largest real root of m³ + b m² + c m + d.
double largest_cubic_root(double b, double c, double d) noexcept {
  const double p = c - b * b / 3, q = 2 * b * b * b / 27 - b * c / 3 + d;
  const double discriminant = q * q / 4 + p * p * p / 27;
  if (discriminant > 0) {
    // One real root; the larger cube root first, the other from their product −p/3.
    const double u = std::cbrt(-q / 2 - std::copysign(std::sqrt(discriminant), q));
    return u + (u != 0 ? -p / (3 * u) : 0.0) - b / 3;
  }
  const double radius = std::sqrt(-p / 3);
  if (radius == 0) return -b / 3;
  const double angle = std::acos(std::clamp(-q / 2 / (radius * radius * radius), -1.0, 1.0));
  return 2 * radius * std::cos(angle / 3) - b / 3;
}

double polished(double x, double p, double q, double r) noexcept {
  for (int i = 0; i < 3; ++i) {
    const double f = ((x * x + p) * x + q) * x + r, slope = (4 * x * x + 2 * p) * x + q;
    if (slope == 0) break;
    const double next = x - f / slope;
    if (std::abs(((next * next + p) * next + q) * next + r) >= std::abs(f)) break;
    x = next;
  }
  return x;
}

}  // namespace

Roots depressed_quartic_roots(double p, double q, double r) noexcept {
  Roots roots;
  const auto quadratic = [&](double b, double c) {  // x² + b x + c; a slightly negative discriminant is a double root
    const double discriminant = b * b / 4 - c;
    if (discriminant < -1e-9 * (b * b / 4 + std::abs(c))) return;
    const double root = std::sqrt(std::max(discriminant, 0.0));
    roots.add(polished(-b / 2 - root, p, q, r));
    roots.add(polished(-b / 2 + root, p, q, r));
  };
  // (x² + p/2 + m)² = 2m (x − q/(4m))² for a root m of the resolvent cubic.
  const double m = largest_cubic_root(p, p * p / 4 - r, -q * q / 8);
  const double scale = std::abs(p) + std::sqrt(std::abs(r));
  if (m > 1e-12 * scale && q != 0) {
    const double s = std::sqrt(2 * m);
    quadratic(s, p / 2 + m - q / (2 * s));
    quadratic(-s, p / 2 + m + q / (2 * s));
  } else {  // biquadratic: x² = −p/2 ± √(p²/4 − r)
    const double discriminant = std::max(p * p / 4 - r, 0.0);
    for (const double sign : {-1.0, 1.0}) {
      const double square = -p / 2 + sign * std::sqrt(discriminant);
      if (square < 0) continue;
      roots.add(polished(std::sqrt(square), p, q, r));
      roots.add(polished(-std::sqrt(square), p, q, r));
    }
  }
  return roots;
}

CostToGo cost_to_go(const State& from, const Vec3& goal_W, double rho, double least_duration) noexcept {
  // With v_g = 0 the paper's sum is 12|D|²/T³ − 12 D·v/T² + 4|v|²/T; its derivative times T⁴ is the quartic
  // ρT⁴ − 4|v|²T² + 24 D·v T − 36|D|².
  const Vec3 D = goal_W - from.p_W;
  const double DD = D.squaredNorm(), Dv = D.dot(from.v_W), vv = from.v_W.squaredNorm();
  if (DD == 0 && vv == 0) return {rho * least_duration, least_duration};
  const auto cost = [&](double T) { return rho * T + (12 * DD / T - 12 * Dv) / (T * T) + 4 * vv / T; };
  CostToGo best{least_duration > 0 ? cost(least_duration) : INFINITY, least_duration};
  // Quartic, slope and curvature positive at the least duration: the cost only grows from there.
  const double T = least_duration;
  if (((rho * T * T - 4 * vv) * T + 24 * Dv) * T > 36 * DD && 4 * rho * T * T * T - 8 * vv * T + 24 * Dv > 0 &&
      12 * rho * T * T > 8 * vv)
    return best;
  for (const double root : depressed_quartic_roots(-4 * vv / rho, 24 * Dv / rho, -36 * DD / rho))
    if (root > least_duration && root > 0 && cost(root) < best.cost) best = {cost(root), root};
  return best;
}

double least_stopping_time(double distance, double speed, double v_max, double a_max) noexcept {
  const double V = std::max(v_max, speed);
  const double peak = std::sqrt(a_max * std::max(distance, 0.0) + speed * speed / 2);
  if (peak <= speed) return speed / a_max;
  if (peak <= V) return (2 * peak - speed) / a_max;
  return distance / V + ((V - speed) * (V - speed) + V * V) / (2 * a_max * V);
}

}  // namespace backwash::plan
