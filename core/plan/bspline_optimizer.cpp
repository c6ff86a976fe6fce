// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/bspline_optimizer.hpp"

#include <algorithm>
#include <nlopt.hpp>
#include <utility>

namespace backwash::plan {

SplineCost::SplineCost(const map::DistanceField& distance, const Vehicle& vehicle, reach::Loop loop,
                       const PlanStart& start, const BSpline& spline, std::vector<double> keep_away,
                       const Vec3& v_limit, const Vec3& a_limit, const CostWeights& weights)
    : distance_(distance),
      vehicle_(vehicle),
      loop_(loop),
      adjoint_(vehicle, loop),
      start_(start),
      initial_(spline),
      keep_away_(std::move(keep_away)),
      v_limit_(v_limit),
      a_limit_(a_limit),
      weights_(weights) {}

std::vector<double> SplineCost::start_point() const {
  std::vector<double> x;
  for (std::size_t i = 3; i + 3 < initial_.control_points.size(); ++i)
    for (int axis = 0; axis < 3; ++axis) x.push_back(initial_.control_points[i][axis]);
  return x;
}

BSpline SplineCost::spline_at(std::span<const double> x) const {
  BSpline spline = initial_;
  for (std::size_t i = 0; i < x.size() / 3; ++i) spline.control_points[i + 3] = {x[3 * i], x[3 * i + 1], x[3 * i + 2]};
  return spline;
}

SplineCost::Value SplineCost::operator()(std::span<const double> x) const {
  const BSpline spline = spline_at(x);
  const PointCost s = smoothness(spline), c = collision(spline), p = limits(spline);
  Value value{weights_.smooth * s.f + weights_.collision * c.f + weights_.physical * p.f, {}};
  for (std::size_t i = 3; i + 3 < spline.control_points.size(); ++i) {
    const Vec3 g =
        weights_.smooth * s.gradient[i] + weights_.collision * c.gradient[i] + weights_.physical * p.gradient[i];
    value.gradient.insert(value.gradient.end(), g.data(), g.data() + 3);
  }
  return value;
}

SplineCost::PointCost SplineCost::smoothness(const BSpline& spline) const {
  const auto& q = spline.control_points;
  PointCost cost{0, std::vector<Vec3>(q.size(), Vec3::Zero())};
  for (std::size_t i = 0; i + 3 < q.size(); ++i) {
    const Vec3 third = -q[i] + 3 * q[i + 1] - 3 * q[i + 2] + q[i + 3];
    cost.f += third.squaredNorm();
    cost.gradient[i] -= 2 * third;
    cost.gradient[i + 1] += 6 * third;
    cost.gradient[i + 2] -= 6 * third;
    cost.gradient[i + 3] += 2 * third;
  }
  return cost;
}

SplineCost::PointCost SplineCost::limits(const BSpline& spline) const {
  PointCost cost{0, std::vector<Vec3>(spline.control_points.size(), Vec3::Zero())};
  // Adds (x² − limit²)² of each axis beyond its limit; returns the derivative by x.
  const auto beyond = [&cost](const Vec3& x, const Vec3& limit) {
    const Eigen::Array3d excess = (x.array().square() - limit.array().square()).max(0.0);
    cost.f += excess.square().sum();
    return Vec3(4 * excess * x.array());
  };
  const double d = 1 / spline.knot_span;
  const auto velocity = spline.velocity_points(), acceleration = spline.acceleration_points();
  for (std::size_t i = 0; i < velocity.size(); ++i) {
    const Vec3 slope = d * beyond(velocity[i], v_limit_);
    cost.gradient[i] -= slope;
    cost.gradient[i + 1] += slope;
  }
  for (std::size_t i = 0; i < acceleration.size(); ++i) {
    const Vec3 slope = d * d * beyond(acceleration[i], a_limit_);
    cost.gradient[i] += slope;
    cost.gradient[i + 1] -= 2 * slope;
    cost.gradient[i + 2] += slope;
  }
  return cost;
}

SplineCost::PointCost SplineCost::collision(const BSpline& spline) const {
  const std::size_t n = keep_away_.size() - 1;  // commands, the last ones holding the end
  std::vector<Vec3> by_position(n, Vec3::Zero()), by_velocity(n, Vec3::Zero());
  PointCost cost{0, std::vector<Vec3>(spline.control_points.size(), Vec3::Zero())};
  reach::CentrePredictor centre(vehicle_, loop_, start_.estimated, start_.command.a_W, start_.command);
  for (std::size_t k = 0; k < n; ++k) {
    const State state = centre.step(spline.at(static_cast<double>(k) * kControlPeriod));
    const double lack = keep_away_[k + 1] - distance_.interpolated(state.p_W), speed = state.v_W.norm();
    if (lack <= 0) continue;
    cost.f += lack * lack * speed * kControlPeriod;
    by_position[k] = -2 * lack * speed * kControlPeriod * distance_.gradient(state.p_W);
    if (speed > 0) by_velocity[k] = lack * lack * kControlPeriod / speed * state.v_W;
  }
  if (cost.f == 0) return cost;

  const auto by_command = adjoint_.pull_back(by_position, by_velocity);
  for (std::size_t k = 0; k < n; ++k) {
    const double t = static_cast<double>(k) * kControlPeriod;
    for (int order = 0; order < 3; ++order) {
      if (order > 0 && t >= spline.duration()) break;  // held: velocity and acceleration commands are zero
      const auto [first, w] = weights(spline.control_points.size(), spline.knot_span, t, order);
      const Vec3& g = order == 0 ? by_command.p[k] : order == 1 ? by_command.v[k] : by_command.a[k];
      for (std::size_t i = 0; i < 4; ++i) cost.gradient[first + i] += w[i] * g;
    }
  }
  return cost;
}

namespace {

/// What the solver's callback needs, and the best point it has seen.
struct Run {
  const SplineCost& cost;
  Clock::time_point deadline;
  double scale, best_f;
  std::vector<double> best_x;
  std::size_t evaluations = 0;
};

double evaluate(const std::vector<double>& x, std::vector<double>& gradient, void* data) {
  Run& run = *static_cast<Run*>(data);
  if (Clock::now() > run.deadline) throw nlopt::forced_stop();
  const auto value = run.cost(x);
  ++run.evaluations;
  if (value.f < run.best_f) run.best_f = value.f, run.best_x = x;
  if (!gradient.empty())
    std::ranges::transform(value.gradient, gradient.begin(), [&](double g) { return run.scale * g; });
  return run.scale * value.f;
}

}  // namespace

OptimizerResult optimise(const SplineCost& cost, std::size_t max_evaluations, Clock::time_point deadline) {
  std::vector<double> x = cost.start_point();
  const auto first = cost(x);
  double steepest = 0;
  for (const double g : first.gradient) steepest = std::max(steepest, std::abs(g));
  Run run{cost, deadline, steepest > 0 ? 0.1 / steepest : 1, first.f, x};
  if (steepest > 0) {
    nlopt::opt solver(nlopt::LD_LBFGS, static_cast<unsigned>(x.size()));
    solver.set_min_objective(evaluate, &run);
    solver.set_maxeval(static_cast<int>(max_evaluations));
    solver.set_ftol_rel(1e-4);
    try {
      double f = 0;
      solver.optimize(x, f);
    } catch (const std::exception&) {
      // Deadline or "nlopt failure" of a line search: the best point seen stands.
    }
  }
  return {cost.spline_at(run.best_x), run.best_f, run.evaluations + 1};
}

}  // namespace backwash::plan
