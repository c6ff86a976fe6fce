// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/findings/applied.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/study/inference/coverage.hpp"
#include "core/study/inference/rules.hpp"

namespace backwash::study {
namespace {

/// θ and the companions' coefficients behind it.
struct Parts {
  std::vector<DesignColumn> columns;  // the form's, then its companions
  std::size_t own;                    // how many are the form's
};

Parts parts_of(const Accepted& cause, const Observations& seen) {
  Parts parts{cause.columns, cause.columns.size()};
  const auto open = companions(*cause.form, seen);
  parts.columns.insert(parts.columns.end(), open.begin(), open.end());
  return parts;
}

bool of_variance(const DesignColumn& column) {
  return std::all_of(column.parts.begin(), column.parts.end(),
                     [](auto& p) { return p.channel == kVarX || p.channel == kVarY || p.channel == kVarZ; });
}

/// Coefficients of the companions, given θ, from normal equations of both: without one flight, or of all (none).
SmallVector with_companions(const NormalEquations& normal, const SmallVector& theta,
                            std::optional<std::size_t> without) {
  SmallMatrix A = normal.total;
  SmallVector b = SmallVector::Zero(A.rows());
  for (std::size_t f = 0; f < normal.b.size(); ++f)
    if (f != without) b += normal.b[f];
  if (without) A -= normal.A[*without];
  const auto p = theta.size(), q = A.rows() - p;
  SmallVector all(p + q);
  all.head(p) = theta;
  if (q > 0) {
    const Eigen::MatrixXd open = A.bottomRightCorner(q, q);
    const Eigen::VectorXd rest = b.tail(q) - A.bottomLeftCorner(q, p) * theta;
    all.tail(q) = open.completeOrthogonalDecomposition().solve(rest);
  }
  return all;
}

using Moved = std::array<std::vector<double>, kChannels>;

void add(Moved& moved, const std::vector<DesignColumn>& columns, const SmallVector& by, std::size_t begin,
         std::size_t end, std::size_t windows) {
  for (std::size_t k = 0; k < columns.size(); ++k)
    for (const auto& part : columns[k].parts) {
      moved[part.channel].resize(windows, 0);
      for (std::size_t i = begin; i < end; ++i) moved[part.channel][i] += by[static_cast<Eigen::Index>(k)] * part.x[i];
    }
}

double at(const Moved& moved, std::size_t channel, std::size_t i) {
  return moved[channel].empty() ? 0 : moved[channel][i];
}

/// Errors of the window values: those of ln variance about their mean.
void measure_error(Applied& applied, const Observations& seen, const Moved& own, const Moved& others) {
  double before = 0, after = 0, count = 0;
  for (std::size_t c = 0; c < kChannels; ++c) {
    if (own[c].empty()) continue;
    double level_before = 0, level_after = 0, weight = 0;
    const auto left = [&](std::size_t i) { return seen.y[c][i] - at(others, c, i); };
    for (std::size_t i = 0; i < own[c].size() && c >= kVarX && c <= kVarZ; ++i) {
      const double w = seen.weight[c][i];
      level_before += w * left(i);
      level_after += w * (left(i) - own[c][i]);
      weight += w;
    }
    if (weight > 0) {
      level_before /= weight;
      level_after /= weight;
    }
    for (std::size_t i = 0; i < own[c].size(); ++i) {
      const double w = seen.weight[c][i];
      before += w * std::pow(left(i) - level_before, 2);
      after += w * std::pow(left(i) - own[c][i] - level_after, 2);
      count += w;
    }
  }
  if (count > 0) {
    applied.rmse_before = std::sqrt(before / count);
    applied.rmse_after = std::sqrt(after / count);
  }
}

void measure_coverage(Applied& applied, const Observations& seen, const Moved& own, const Moved& others) {
  double before = 0, after = 0, samples = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t mean = kMeanX + static_cast<std::size_t>(axis), variance = kVarX + static_cast<std::size_t>(axis);
    for (std::size_t i = 0; i < seen.windows.size(); ++i) {
      if (!(seen.weight[variance][i] > 0)) continue;
      const auto& w = seen.windows[i];
      const double m = seen.y[mean][i] - at(others, mean, i), sigma = w.sigma[axis] * std::exp(at(others, variance, i));
      before += share_of_interval(m, w.measured_variance[axis], sigma);
      after +=
          share_of_interval(m - at(own, mean, i), w.measured_variance[axis], sigma * std::exp(at(own, variance, i)));
      samples += 1;
    }
  }
  if (samples > 0) {
    applied.coverage_before = before / samples;
    applied.coverage_after = after / samples;
  }
}

/// Judges cause `which` among those that join the model.
Applied judged(const Evidence& evidence, const std::vector<Accepted>& all, const std::vector<Applied>& known,
               std::size_t which) {
  const Observations& seen = evidence.seen();
  const Accepted& cause = all[which];
  const std::size_t n = seen.windows.size();
  const Parts parts = parts_of(cause, seen);
  std::vector<DesignColumn> beside;
  Moved own, others;
  for (std::size_t j = 0; j < all.size(); ++j) {
    if (j == which || !known[j].refused.empty()) continue;
    const Parts other = parts_of(all[j], seen);
    beside.insert(beside.end(), other.columns.begin(), other.columns.end());
    SmallVector by(static_cast<Eigen::Index>(other.columns.size()));
    by.setZero();
    by.head(all[j].theta.size()) = all[j].theta;
    for (std::size_t k = 0; k < known[j].beside.size(); ++k)
      by[all[j].theta.size() + static_cast<Eigen::Index>(k)] = known[j].beside[k];
    add(others, other.columns, by, 0, n, n);
  }
  std::vector<DesignColumn> free = beside, levels = beside;
  if (!cause.form->constant)
    for (const auto& column : offsets(cause.columns, seen)) {
      free.push_back(column);
      if (of_variance(column)) levels.push_back(column);
    }
  const NormalEquations theta = evidence.normal(cause.columns, free), joint = evidence.normal(parts.columns, levels);
  Applied applied;
  const SmallVector whole = with_companions(joint, cause.theta, std::nullopt);
  for (auto k = cause.theta.size(); k < whole.size(); ++k) applied.beside.push_back(whole[k]);
  if (!theta.solvable) {
    applied.refused = "one flight alone tells it: it cannot be judged on others";
    return applied;
  }
  for (std::size_t f = 0; f < seen.units.size(); ++f) {
    const SmallVector by = with_companions(joint, theta.fit_without(f), f);
    applied.nats += by.dot(joint.b[f]) - 0.5 * by.dot(joint.A[f] * by);
    add(own, parts.columns, by, seen.units.first[f], seen.units.first[f + 1], n);
  }
  measure_error(applied, seen, own, others);
  measure_coverage(applied, seen, own, others);
  return applied;
}

std::string why_refused(const Applied& a) {
  if (a.nats <= 0) return "flights that were not fitted are less likely with it";
  if (a.coverage_after < a.coverage_before && a.coverage_after < kRules.coverage_level)
    return "of flights that were not fitted fewer samples lie in the central 90 % with it";
  return "";
}

}  // namespace

std::vector<Applied> judge(const Evidence& evidence, const std::vector<Accepted>& accepted,
                           const std::vector<std::string>& refused) {
  std::vector<Applied> all(accepted.size());
  for (std::size_t i = 0; i < accepted.size(); ++i) all[i].refused = refused[i];
  for (std::size_t i = 0; i < accepted.size(); ++i) all[i].beside = judged(evidence, accepted, all, i).beside;
  for (;;) {
    std::size_t worst = accepted.size();
    for (std::size_t i = 0; i < accepted.size(); ++i) {
      if (!all[i].refused.empty()) continue;
      all[i] = judged(evidence, accepted, all, i);
      if (all[i].refused.empty() && why_refused(all[i]).empty()) continue;
      if (worst == accepted.size() || all[i].nats < all[worst].nats) worst = i;
    }
    if (worst == accepted.size()) break;
    if (all[worst].refused.empty()) all[worst].refused = why_refused(all[worst]);
  }
  for (std::size_t i = 0; i < accepted.size(); ++i) {  // what they were worth beside the others
    if (refused[i].empty()) continue;
    all[i] = judged(evidence, accepted, all, i);
    all[i].refused = refused[i];
  }
  return all;
}

}  // namespace backwash::study
