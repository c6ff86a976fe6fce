// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/reach/response/response_builder.hpp"

namespace backwash::reach {
namespace {

using Eigen::Vector3d;
using Eigen::Vector4d;
constexpr double kMicroStep = 0.25e-3;  // s: cubic interpolation of p is then within 1e-10 of it

// Value and integral of a polynomial given by its derivatives at 0.
double value(const Vector4d& c, double s) { return c[0] + s * (c[1] + s * (c[2] / 2 + s * c[3] / 6)); }
double integral(const Vector4d& c, double from, double to) {
  const auto antiderivative = [&c](double s) { return s * (c[0] + s * (c[1] / 2 + s * (c[2] / 6 + s * c[3] / 24))); };
  return antiderivative(to) - antiderivative(from);
}

// ∫ |c|, split at the zero that a change of sign between the ends brackets.
double absolute_integral(const Vector4d& c, double from, double to) {
  if (value(c, from) * value(c, to) >= 0) return std::abs(integral(c, from, to));
  double low = from, high = to;
  const bool rising = value(c, from) < 0;
  for (int i = 0; i < 48; ++i) {
    const double mid = (low + high) / 2;
    ((value(c, mid) < 0) == rising ? low : high) = mid;
  }
  return std::abs(integral(c, from, low)) + std::abs(integral(c, low, to));
}

// The loop cut into micro-steps that divide the delay, so that every kink of the response (at multiples of the delay)
// is an end of a micro-step.
struct Grid {
  explicit Grid(const AxisLoop& loop)
      : axis(loop),
        per_delay(loop.feedback_delay > 0 ? static_cast<std::size_t>(std::ceil(loop.feedback_delay / kMicroStep)) : 0),
        h(per_delay > 0 ? loop.feedback_delay / static_cast<double>(per_delay) : kMicroStep),
        step(axis_step(loop, per_delay == 0, h)) {}
  double feedback(const Vector3d& x) const { return -axis.kp * x[0] - axis.kd * x[1]; }
  double feedback_rate(const Vector3d& x) const { return -axis.kp * x[1] - axis.kd * x[2]; }
  std::size_t steps_to(double t) const { return static_cast<std::size_t>(std::ceil(t / h - 1e-9)); }

  AxisLoop axis;
  std::size_t per_delay;
  double h;
  AxisStep step;
};

// Disturbance-free motion from x = (p, v, a); the delayed feedback sees `earlier_input` from before time 0.
class Rollout {
 public:
  Rollout(const Grid& grid, const Vector3d& start, double earlier_input)
      : grid_(&grid), next_(start), earlier_input_(earlier_input) {}

  void extend_to(std::size_t count) {
    while (pieces_.size() < count) {
      const Vector4d u = input();
      Piece piece{next_, grid_->step.E * next_ + grid_->step.F * u};
      if (grid_->axis.attitude_lag <= 0) piece.x0[2] = grid_->per_delay > 0 ? u[0] : grid_->feedback(next_);
      next_ = piece.x1;
      pieces_.push_back(piece);
      if (!(next_.norm() < 1e6)) refuse(grid_->axis, "the loop is unstable; lower the gains, the delay or the lag");
    }
  }
  std::size_t size() const { return pieces_.size(); }
  /// State at the end of the first `count` micro-steps.
  Vector3d at(std::size_t count) const { return count == 0 ? pieces_[0].x0 : pieces_[count - 1].x1; }
  Vector4d position(std::size_t i) const {
    const auto& [a, b] = pieces_[i];
    return cubic_through(a[0], a[1], b[0], b[1], grid_->h);
  }
  Vector4d velocity(std::size_t i) const {
    const auto& [a, b] = pieces_[i];
    return cubic_through(a[1], a[2], b[1], b[2], grid_->h);
  }
  /// sup |k_p p + k_d v| over the micro-steps [from, to).
  double largest_feedback(std::size_t from, std::size_t to) const {
    double largest = 0;
    for (std::size_t i = from; i < to; ++i)
      for (const Vector3d& x : {pieces_[i].x0, pieces_[i].x1})
        largest = std::max(largest, std::abs(grid_->feedback(x)));
    return largest;
  }
  /// ∫ |p|, |v|, |a|, |k_p p + k_d v| over the micro-steps [from, to), by the trapezoid rule.
  Vector4d absolute_integrals(std::size_t from, std::size_t to) const {
    Vector4d sum = Vector4d::Zero();
    for (std::size_t i = from; i < to; ++i)
      for (const Vector3d& x : {pieces_[i].x0, pieces_[i].x1}) {
        sum.head<3>() += x.cwiseAbs() * (grid_->h / 2);
        sum[3] += std::abs(grid_->feedback(x)) * (grid_->h / 2);
      }
    return sum;
  }

 private:
  struct Piece {
    Vector3d x0, x1;
  };
  Vector4d input() const {
    const std::size_t i = pieces_.size(), m = grid_->per_delay;
    if (m == 0) return Vector4d::Zero();
    if (i < m) return {earlier_input_, 0, 0, 0};
    const auto& [a, b] = pieces_[i - m];
    return cubic_through(grid_->feedback(a), grid_->feedback_rate(a), grid_->feedback(b), grid_->feedback_rate(b),
                         grid_->h);
  }

  const Grid* grid_;
  std::vector<Piece> pieces_;
  Vector3d next_;
  double earlier_input_;
};

// What is still to come of a motion, bounded from its summary z = (|p|, |v|, |a|, sup |k_p p + k_d v| over the last
// delay): ∫_t^∞ |p| ≤ weight·z(t), and sup_{≥ t} |p| ≤ peak·weight·z(t).
struct Remainder {
  Vector4d weight;
  double peak;
};

Vector4d summary(const Grid& grid, const Rollout& rollout, std::size_t count) {
  Vector4d z;
  z.head<3>() = rollout.at(count).cwiseAbs();
  z[3] = rollout.largest_feedback(count - std::min(count, grid.per_delay), count);
  return z;
}

// Over a window T, z(t + T) ≤ A z(t) for the non-negative matrix A built from the responses to a unit p, v, a and to a
// pending input of at most 1. With weights y = what |p| integrates to in one window, y A ≤ y/2 gives
// ∫^∞ |p| ≤ Σ_n y Aⁿ z ≤ 2 y z.
std::optional<Remainder> contraction(const Grid& grid, const std::array<Rollout, 3>& unit, std::size_t window) {
  const bool lag = grid.axis.attitude_lag > 0;
  const std::size_t m = grid.per_delay;
  Eigen::Matrix4d A = Eigen::Matrix4d::Zero();
  Eigen::RowVector4d y = Eigen::RowVector4d::Zero(), top = Eigen::RowVector4d::Zero();
  for (int i = 0; i < (lag ? 3 : 2); ++i) {
    A.col(i) = summary(grid, unit[i], window);
    y[i] = unit[i].absolute_integrals(0, window)[0];
    for (std::size_t k = 0; k <= window; ++k) top[i] = std::max(top[i], std::abs(unit[i].at(k)[0]));
  }
  if (m > 0) {  // an impulse of the input is a unit v, or a of 1/lag
    const Rollout& impulse = lag ? unit[2] : unit[1];
    const double scale = lag ? 1 / grid.axis.attitude_lag : 1;
    A.col(3).head<3>() = scale * impulse.absolute_integrals(window - m, window).head<3>();
    A(3, 3) = scale * impulse.absolute_integrals(window - 2 * m, window)[3];
    y[3] = scale * grid.axis.feedback_delay * impulse.absolute_integrals(0, window)[0];
    top[3] = scale * grid.axis.feedback_delay * (lag ? top[2] : top[1]);
  }
  if (!lag) A.row(2).setZero();
  constexpr double kQuadrature = 1.01;  // covers the trapezoid rule and maxima taken at ends
  A *= kQuadrature;
  y *= kQuadrature;
  top *= kQuadrature;
  if (((y * A).array() > y.array() / 2).any()) return std::nullopt;
  // The same matrix carries the supremum: with peak·2y ≥ top, later windows stay below it.
  double peak = 0;
  for (int i = 0; i < 4; ++i)
    if (y[i] > 0) peak = std::max(peak, top[i] / (2 * y[i]));
  return Remainder{2 * y.transpose(), peak};
}

Remainder remainder(const Grid& grid, std::array<Rollout, 3>& unit) {
  const double first = std::max(0.25, 2 * grid.axis.feedback_delay);
  for (double T = first; T < kLongestMemory; T *= 1.25) {
    const std::size_t window = grid.steps_to(T);
    for (Rollout& rollout : unit) rollout.extend_to(window);
    if (const auto found = contraction(grid, unit, window)) return *found;
  }
  refuse(grid.axis, "the loop does not settle within two minutes; it is unstable or its position gain is too low");
}

// ∫_0^t |p| at t = 0, kPhase, 2 kPhase, …
std::vector<double> absolute_integral_at_phases(const Grid& grid, const Rollout& rollout, std::size_t phases) {
  std::vector<double> at{0.0};
  double sum = 0;
  for (std::size_t i = 0; i < rollout.size() && at.size() <= phases; ++i) {
    const Vector4d p = rollout.position(i);
    const double start = grid.h * static_cast<double>(i);
    while (at.size() <= phases && kPhase * static_cast<double>(at.size()) <= start + grid.h * (1 + 1e-9))
      at.push_back(sum + absolute_integral(p, 0, kPhase * static_cast<double>(at.size()) - start));
    sum += absolute_integral(p, 0, grid.h);
  }
  return at;
}

std::vector<double> position_at_phases(const Grid& grid, const Rollout& rollout, std::size_t phases) {
  std::vector<double> at;
  for (std::size_t m = 0; m <= phases; ++m) {
    const double t = kPhase * static_cast<double>(m);
    const std::size_t i = std::min(static_cast<std::size_t>(t / grid.h), rollout.size() - 1);
    at.push_back(value(rollout.position(i), t - grid.h * static_cast<double>(i)));
  }
  return at;
}

// Largest |u| of a disturbance-free motion; |a| stays below it because a starts at 0 and follows u.
double largest_input(const Rollout& rollout) { return rollout.largest_feedback(0, rollout.size()); }

}  // namespace

AxisResponse continuous_response(const AxisLoop& axis) {
  if (axis.feedback_delay == 0 && axis.attitude_lag * axis.kp >= axis.kd)  // Routh–Hurwitz
    refuse(axis, "the loop is unstable; lower the position gain or the lag");
  const Grid grid(axis);
  std::array<Rollout, 3> unit{Rollout(grid, Vector3d::UnitX(), 0), Rollout(grid, Vector3d::UnitY(), 0),
                              Rollout(grid, Vector3d::UnitZ(), 0)};
  const Remainder rest = remainder(grid, unit);

  Rollout& g = unit[1];  // an impulse of acceleration is a unit velocity with nothing pending
  std::size_t steps = 0;
  double tail = 0, known = 0;
  for (std::size_t i = 0; steps == 0 || tail > kTailShare * known;) {
    steps += 10;
    const std::size_t count = grid.steps_to(kControlPeriod * static_cast<double>(steps)) + 1;
    g.extend_to(count);
    for (; i < count - 1; ++i) known += absolute_integral(g.position(i), 0, grid.h);
    tail = rest.weight.dot(summary(grid, g, count - 1));
  }
  // One more step: between samples the share of a step of age N begins up to 20 ms before N dt.
  ++steps;
  const std::size_t phases = steps * kPhases;
  const std::size_t count = grid.steps_to(kControlPeriod * static_cast<double>(steps)) + 1;
  g.extend_to(count);

  AxisResponse response;
  const std::vector<double> P = absolute_integral_at_phases(grid, g, phases);
  response.S.resize(steps);
  for (std::size_t m = 1; m <= phases; ++m)
    response.S[(m - 1) / kPhases][(m - 1) % kPhases] = P[m] - (m > kPhases ? P[m - kPhases] : 0.0);
  response.tail = tail;
  response.h_inf = P[phases] + tail;
  response.velocity_inf = 0;
  for (std::size_t i = 0; i < count; ++i) response.velocity_inf += absolute_integral(g.velocity(i), 0, grid.h);
  response.acceleration_inf = 1 + axis.kp * response.h_inf + axis.kd * response.velocity_inf;

  Rollout from_position(grid, Vector3d::UnitX(), -axis.kp), from_velocity(grid, Vector3d::UnitY(), -axis.kd);
  from_position.extend_to(count);
  from_velocity.extend_to(count);
  response.from_position = position_at_phases(grid, from_position, phases);
  response.from_velocity = position_at_phases(grid, from_velocity, phases);
  response.from_position_tail = rest.peak * rest.weight.dot(summary(grid, from_position, count - 1));
  response.from_velocity_tail = rest.peak * rest.weight.dot(summary(grid, from_velocity, count - 1));
  response.acceleration_from_position = largest_input(from_position);
  response.acceleration_from_velocity = largest_input(from_velocity);
  return response;
}

}  // namespace backwash::reach
