// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/estimate.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlopt.hpp>

#include "core/study/effects/columns.hpp"

namespace backwash::study {
namespace {

constexpr int kFine = static_cast<int>(kRules.fine_scales);

/// A shape of the cause at a scale, fitted to all flights, with its error by leaving each out.
struct FamilyMember {
  const Form* shape;
  Scale scale;
  NormalEquations normal;
  SmallVector theta, error;
  double height;  ///< ln likelihood over that without the cause
};

std::vector<Scale> fine_scales(const Form& form, const Scale& at) {
  if (form.integer_scale || form.scales.size() < 2) return {at};
  const double beyond = kRules.beyond_scales;
  const double low = std::log(form.scales.front().value / beyond), high = std::log(form.scales.back().value * beyond);
  std::vector<Scale> scales;
  scales.reserve(kFine);
  for (int i = 0; i < kFine; ++i)
    scales.push_back({std::exp(low + (high - low) * i / (kFine - 1)), at.offset_W, at.anchor});
  return scales;
}

/// Standard errors by the jackknife: √((n − 1)/n Σ (θ₋f − θ̄)²), one column of `left` per flight.
Eigen::VectorXd jackknife(const Eigen::MatrixXd& left) {
  const double n = static_cast<double>(left.cols());
  return ((n - 1) / n * (left.colwise() - left.rowwise().mean()).rowwise().squaredNorm()).cwiseSqrt();
}

bool lower(const FamilyMember& a, const FamilyMember& b) { return a.height < b.height; }

FamilyMember fitted(NormalEquations normal, const Form* shape, const Scale& scale) {
  Eigen::MatrixXd left(normal.total.rows(), static_cast<Eigen::Index>(normal.b.size()));
  SmallVector sum = SmallVector::Zero(normal.total.rows());
  for (std::size_t f = 0; f < normal.b.size(); ++f) {
    left.col(static_cast<Eigen::Index>(f)) = normal.fit_without(f);
    sum += normal.b[f];
  }
  SmallVector theta = normal.fit();
  const double height = 0.5 * theta.dot(sum);
  return {shape, scale, std::move(normal), theta, SmallVector(jackknife(left)), height};
}

std::vector<LeftOut> by_flight(const NormalEquations& normal) {
  std::vector<LeftOut> flights;
  const auto nats = normal.gain_per_flight();
  for (std::size_t f = 0; f < nats.size(); ++f) flights.push_back({nats[f], normal.fit_without(f)});
  return flights;
}

using Objective = std::function<double(const std::vector<double>&)>;

double evaluate(const std::vector<double>& x, std::vector<double>&, void* objective) {
  return (*static_cast<Objective*>(objective))(x);
}

/// Where the objective is largest between the bounds; the start if the solver fails.
std::vector<double> polished(const std::vector<double>& start, double step, const std::vector<double>& low,
                             const std::vector<double>& high, Objective objective) {
  nlopt::opt solver(nlopt::LN_NELDERMEAD, static_cast<unsigned>(start.size()));
  solver.set_max_objective(evaluate, &objective);
  solver.set_lower_bounds(low);
  solver.set_upper_bounds(high);
  solver.set_initial_step(step);
  solver.set_xtol_abs(step / kRules.polish_divisor);
  solver.set_maxeval(static_cast<int>(kRules.polish_evaluations));
  std::vector<double> best = start;
  try {
    double f = 0;
    solver.optimize(best, f);
  } catch (const std::exception&) {
    return start;
  }
  return best;
}

/// What of a rotor's deviation is how the craft was built, the same in each of its flights: of θ = Σ x y / Σ x².
double built_error(const DesignColumn& column) {
  const Channel c = column.parts.front().channel;
  double square = 0;
  for (const auto& part : column.parts)
    if (!part.x.empty() && built_scatter(part.channel) == built_scatter(c)) square += part.x.front() * part.x.front();
  return square > 0 ? built_scatter(c) / std::sqrt(square) : 0;
}

/// The form at a level offset.
DesignColumn with_map_moved(const Windows& windows, double x, double y) {
  return displaced(windows, {x, y, 0}).front();
}

/// Standard errors of the offset (x, y) that fits best: jackknife of the fit's linearisation there.
Eigen::VectorXd offset_error(const Evidence& evidence, const std::vector<DesignColumn>& nuisance, double x, double y) {
  constexpr double kDifference = kRules.offset_difference;
  const auto& windows = evidence.seen().windows;
  const auto slope = [&](double dx, double dy) {
    DesignColumn high = with_map_moved(windows, x + dx, y + dy);
    const DesignColumn low = with_map_moved(windows, x - dx, y - dy);
    for (std::size_t k = 0; k < high.parts.size(); ++k)
      for (std::size_t i = 0; i < windows.size(); ++i)
        high.parts[k].x[i] = (high.parts[k].x[i] - low.parts[k].x[i]) / (2 * kDifference);
    return high;
  };
  const NormalEquations n =
      evidence.normal({slope(kDifference, 0), slope(0, kDifference), with_map_moved(windows, x, y)}, nuisance);
  Eigen::MatrixXd left(2, static_cast<Eigen::Index>(n.b.size()));
  for (std::size_t out = 0; out < n.b.size(); ++out) {
    Eigen::Matrix2d A = kRules.ridge * Eigen::Matrix2d::Identity();
    Eigen::Vector2d b = Eigen::Vector2d::Zero();
    for (std::size_t f = 0; f < n.b.size(); ++f)
      if (f != out) {
        A += n.A[f].topLeftCorner(2, 2);
        b += n.b[f].head(2) - n.A[f].col(2).head(2);
      }
    left.col(static_cast<Eigen::Index>(out)) = A.ldlt().solve(b);
  }
  return jackknife(left);
}

/// The offset o at which ln Σ(p + o) − ln Σ(p), share 1, is likeliest.
void refine_offset(const Evidence& evidence, Accepted& cause, const std::vector<DesignColumn>& others) {
  const auto& windows = evidence.seen().windows;
  auto nuisance = offsets(cause.columns, evidence.seen());
  nuisance.insert(nuisance.end(), others.begin(), others.end());
  const auto height = [&](const std::vector<double>& o) {
    const NormalEquations n = evidence.normal({with_map_moved(windows, o[0], o[1])}, nuisance);
    double sum = 0;
    for (std::size_t f = 0; f < n.b.size(); ++f) sum += n.b[f][0] - 0.5 * n.A[f](0, 0);
    return sum;
  };
  const Vec3 start = cause.scale.offset_W;
  const double far = kOffsetStep * (kOffsetsAside - 1) / 2;
  const auto best = polished({start.x(), start.y()}, kOffsetStep, {-far, -far}, {far, far}, height);
  cause.scale.offset_W = whole_millimetres({best[0], best[1], 0});
  cause.columns = cause.form->columns(windows, cause.scale);
  cause.theta = SmallVector::Ones(1);
  const NormalEquations own = evidence.normal(cause.columns, nuisance);
  if (own.solvable) {
    cause.gain = own.gain();
    cause.flights = by_flight(own);
  }
  const Eigen::VectorXd error =
      student_975(static_cast<double>(own.b.size()) - 1) * offset_error(evidence, nuisance, best[0], best[1]);
  cause.parameters = {{"x_m", best[0], best[0] - error[0], best[0] + error[0]},
                      {"y_m", best[1], best[1] - error[1], best[1] + error[1]}};
}

/// Takes the parts that speak of variances or of the commands' delay out of a column, and returns them: what a push
/// adds to a window's variance, or makes of the loop's answer, goes by its course along the window, which is known less
/// well than its mean, and has a factor of its own in a size. Of a column that speaks of no mean nothing is taken.
DesignColumn without_course(DesignColumn& column) {
  DesignColumn taken;
  if (column.parts.front().channel > kMeanZ) return taken;
  std::erase_if(column.parts, [&](auto& part) {
    const bool course = part.channel == kCommandDelayH || std::ranges::count(kVariances, part.channel) > 0;
    if (course) taken.parts.push_back(part);
    return course;
  });
  return taken;
}

/// All shapes of a form at all scales, fitted where the craft was. Each of these is as likely beforehand as any other:
/// a law without a scale is one member, as it is the limit of a shape whose scale grows.
struct Family {
  const Evidence& evidence;
  const std::vector<DesignColumn>& others;
  Scale scale;               ///< of a form without a grid of scales
  std::vector<Form> shapes;  ///< the form itself first
  Windows windows;
  std::vector<FamilyMember> members = {};  ///< in the order of shapes and scales

  NormalEquations normal_at(const Form& shape, const Scale& at) const {
    auto columns = shape.columns(windows, at);
    auto nuisance = shape.constant ? std::vector<DesignColumn>{} : offsets(columns, evidence.seen(), others);
    if (shapes[0].by_size) nuisance.push_back(without_course(columns[0]));
    const auto open = companions(shapes[0], evidence.seen());
    nuisance.insert(nuisance.end(), open.begin(), open.end());
    nuisance.insert(nuisance.end(), others.begin(), others.end());
    return evidence.normal(columns, nuisance);
  }

  void fit() {
    members.clear();
    for (const Form& shape : shapes) {
      const auto scales = fine_scales(shape, scale);
      for (const Scale& at : scales) {
        NormalEquations n = normal_at(shape, at);
        if (n.solvable) members.push_back(fitted(std::move(n), &shape, at));
      }
    }
  }

  /// Moves the craft to where the likeliest shape pushes it, and fits again there.
  void follow_push() {
    for (int i = 0; i < kRules.rounds && !members.empty(); ++i) {
      FamilyMember now = *std::max_element(members.begin(), members.end(), lower);
      for (int k = 0; k < kRules.turns; ++k) {
        windows = moved_by(evidence.seen().windows, now.shape->columns(windows, now.scale), now.theta);
        now.theta = normal_at(*now.shape, now.scale).fit();
      }
      fit();
    }
  }

  /// The columns at what the cause's own size leaves: of the speed, of the gusts within a window, of the thrust.
  void follow_size() {
    for (int k = 0; k < kRules.turns; ++k) {
      const NormalEquations n = normal_at(shapes[0], scale);
      if (!n.solvable) return;
      scale.anchor = {n.fit()[0]};
    }
    fit();
  }

  /// How many members are of the form itself.
  std::size_t own() const {
    return static_cast<std::size_t>(
        std::count_if(members.begin(), members.end(), [&](auto& m) { return m.shape == &shapes[0]; }));
  }

  /// The form itself at its likeliest scale. Precondition: own() > 0.
  FamilyMember best_own() const {
    const auto n = static_cast<std::ptrdiff_t>(own());
    const FamilyMember& start = *std::max_element(members.begin(), members.begin() + n, lower);
    if (n == 1) return start;
    const double low = std::log(members.front().scale.value), high = std::log(members[own() - 1].scale.value);
    const auto height = [&](const std::vector<double>& ln) {
      NormalEquations normal = normal_at(shapes[0], {std::exp(ln[0]), scale.offset_W, scale.anchor});
      return normal.solvable ? fitted(std::move(normal), nullptr, {}).height : -HUGE_VAL;
    };
    const double at =
        std::exp(polished({std::log(start.scale.value)}, 0.5 * (high - low) / kFine, {low}, {high}, height)[0]);
    const Scale polished_at{at, scale.offset_W, scale.anchor};
    return fitted(normal_at(shapes[0], polished_at), &shapes[0], polished_at);
  }

  /// Each parameter, averaged over the members. `columns`: of the form itself.
  std::vector<Estimate> parameters(const std::vector<DesignColumn>& columns) const {
    const double highest = std::max_element(members.begin(), members.end(), lower)->height;
    const double wide = student_975(static_cast<double>(members.front().normal.b.size()) - 1) / kRules.normal_975;
    std::vector<Estimate> all;
    for (std::size_t k = 0; k < columns.size(); ++k) {
      const double unknowable =
          k == 0 ? shapes[0].unknowable(evidence.seen()) / std::sqrt(3.0) : 0.0;  // any value alike
      std::vector<Guess> guesses;
      for (const auto& m : members) {
        const auto i = static_cast<Eigen::Index>(k);
        guesses.push_back({std::exp(m.height - highest), m.theta[i],
                           wide * std::hypot(m.error[i], built_error(columns[k]), unknowable)});
      }
      all.push_back(averaged(shapes[0].parameters[k], guesses));
    }
    return all;
  }

  /// Interval of the form's own scale, by likelihood over its grid.
  Estimate scale_interval(const FamilyMember& best) const {
    std::vector<Guess> guesses;
    const double step = std::log(members[1].scale.value / members[0].scale.value);
    for (std::size_t i = 0; i < own(); ++i)
      guesses.push_back({std::exp(members[i].height - best.height), std::log(members[i].scale.value), step / 2});
    const Estimate ln = averaged(shapes[0].scale_name, guesses);
    return {ln.name, best.scale.value, std::exp(ln.low), std::exp(ln.high)};
  }
};

}  // namespace

void refine(const Evidence& evidence, Accepted& cause, const std::vector<DesignColumn>& others) {
  const Form& form = *cause.form;
  if (form.displaces_map) return refine_offset(evidence, cause, others);
  Family family{evidence, others, cause.scale, form.shapes, evidence.seen().windows};
  family.shapes.insert(family.shapes.begin(), form);
  family.fit();
  if (form.by_place) family.follow_push();
  if (form.by_size) family.follow_size();
  if (family.own() == 0) return;
  const FamilyMember best = family.best_own();
  cause.scale = best.scale;
  cause.theta = best.theta;
  cause.gain = best.normal.gain();
  cause.flights = by_flight(best.normal);
  cause.columns = form.columns(family.windows, cause.scale);
  cause.parameters = family.parameters(cause.columns);
  if (family.own() > 1) {
    cause.parameters.push_back(family.scale_interval(best));
  } else if (!form.scale_name.empty()) {
    const double value = cause.scale.value + (form.integer_scale ? 1 : 0);  // rotors count from 1
    cause.parameters.push_back({form.scale_name, value, value, value});
  }
}

bool excludes_zero(const NormalEquations& normal, const std::vector<DesignColumn>& columns) {
  const double t = student_975(static_cast<double>(normal.b.size()) - 1);
  const FamilyMember fit = fitted(normal, nullptr, {});
  for (Eigen::Index k = 0; k < fit.theta.size(); ++k)
    if (std::abs(fit.theta[k]) > t * std::hypot(fit.error[k], built_error(columns[static_cast<std::size_t>(k)])))
      return true;
  return false;
}

}  // namespace backwash::study
