// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/findings/applied.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/study/findings/held_out.hpp"
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

/// Judges cause `which` among those that join the model.
Applied judged(const Evidence& evidence, const std::vector<Accepted>& all, const std::vector<Applied>& known,
               std::size_t which) {
  const Observations& seen = evidence.seen();
  const Accepted& cause = all[which];
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
    add(others, other.columns, by, 0, seen.windows.size(), seen);
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
    add(own, parts.columns, by, seen.units.first[f], seen.units.first[f + 1], seen);
  }
  const Covered share = covered(seen, own, others);
  applied.coverage_before = share.before;
  applied.coverage_after = share.after;
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
