// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/spline/bspline_optimizer.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <nlopt.hpp>
#include <utility>

namespace backwash::plan {

namespace {

using Points = SplineCost::Points;

constexpr double kStiffness = 1e-3;     ///< of single control points, beside that of the third differences
constexpr double kFirstGradient = 0.1;  ///< |g_0|_∞ that the solver sees
// At 1e-3 a short step early on passes for convergence, with up to 500 times the smoothness cost that is left in the
// end.
constexpr double kRelativeDecrease = 1e-4;  ///< of f in a step, below which it has converged

/// Variables in which f_s is well conditioned: with the Hessian of f_s, DᵀD + μI = LLᵀ over the interior control
/// points, the solver sees y = Lᵀq of each axis. A step then bends the curve smoothly instead of moving single control
/// points, and L-BFGS needs tens of evaluations where the plain variables need hundreds.
class SmoothVariables {
 public:
  explicit SmoothVariables(Eigen::Index n) {
    Eigen::MatrixXd D = Eigen::MatrixXd::Zero(n + 3, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      D(i, i) = 1;
      D(i + 1, i) = -3;
      D(i + 2, i) = 3;
      D(i + 3, i) = -1;
    }
    L_ = (D.transpose() * D + kStiffness * Eigen::MatrixXd::Identity(n, n)).llt().matrixL();
  }
  Points from_points(const Points& q) const { return L_.transpose() * q; }
  Points to_points(const Points& y) const { return L_.transpose().triangularView<Eigen::Upper>().solve(y); }
  Points gradient(const Points& by_points) const { return L_.triangularView<Eigen::Lower>().solve(by_points); }

 private:
  Eigen::MatrixXd L_;
};

/// What the solver's callback needs, and the best point it has seen.
struct Run {
  const SplineCost& cost;
  const SmoothVariables& variables;
  Clock::time_point deadline;
  double scale, best_f;
  Points best;
  std::size_t evaluations = 1;
};

double evaluate(const std::vector<double>& y, std::vector<double>& gradient, void* data) {
  Run& run = *static_cast<Run*>(data);
  if (Clock::now() > run.deadline) throw nlopt::forced_stop();
  Points q = run.variables.to_points(Eigen::Map<const Points>(y.data(), run.best.rows(), 3));
  const auto value = run.cost(q);
  ++run.evaluations;
  if (!gradient.empty())
    Eigen::Map<Points>(gradient.data(), q.rows(), 3) = run.scale * run.variables.gradient(value.gradient);
  if (value.f < run.best_f) {
    run.best_f = value.f;
    run.best = std::move(q);
  }
  return run.scale * value.f;
}

}  // namespace

OptimizerResult optimise(const SplineCost& cost, std::size_t max_evaluations, Clock::time_point deadline) {
  const Points start = cost.start_point();
  const auto first = cost(start);
  if (start.rows() == 0) return {cost.spline_at(start), first.f, 1, true};
  const SmoothVariables variables(start.rows());
  const double steepest = variables.gradient(first.gradient).cwiseAbs().maxCoeff();
  Run run{cost, variables, deadline, steepest > 0 ? kFirstGradient / steepest : 1, first.f, start};
  bool converged = steepest == 0;
  if (!converged) {
    nlopt::opt solver(nlopt::LD_LBFGS, static_cast<unsigned>(start.size()));
    solver.set_min_objective(evaluate, &run);
    solver.set_maxeval(static_cast<int>(max_evaluations));
    solver.set_ftol_rel(kRelativeDecrease);
    const Points y = variables.from_points(start);
    std::vector<double> best(y.data(), y.data() + y.size());
    try {
      double f = 0;
      converged = solver.optimize(best, f) == nlopt::FTOL_REACHED;
    } catch (const std::exception&) {
      // Deadline or "nlopt failure" of a line search: the best point seen stands.
    }
  }
  return {cost.spline_at(run.best), run.best_f, run.evaluations, converged};
}

}  // namespace backwash::plan
