// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/normal_equations.hpp"

namespace backwash::study {

SmallVector NormalEquations::fit(const std::vector<int>& signs) const {
  SmallVector sum = SmallVector::Zero(total.rows());
  for (std::size_t f = 0; f < b.size(); ++f) sum += (signs.empty() ? 1 : signs[f]) * b[f];
  return total.ldlt().solve(sum);
}

SmallVector NormalEquations::fit_without(std::size_t flight) const {
  SmallVector sum = SmallVector::Zero(total.rows());
  for (std::size_t f = 0; f < b.size(); ++f)
    if (f != flight) sum += b[f];
  return left_out[flight] * sum;
}

double NormalEquations::gain(const std::vector<int>& signs) const {
  SmallVector sum = SmallVector::Zero(total.rows());
  for (std::size_t f = 0; f < b.size(); ++f) sum += (signs.empty() ? 1 : signs[f]) * b[f];
  double nats = 0;
  for (std::size_t f = 0; f < b.size(); ++f) {
    const SmallVector own = (signs.empty() ? 1 : signs[f]) * b[f];
    const SmallVector theta = left_out[f] * (sum - own);
    nats += theta.dot(own) - 0.5 * theta.dot(A[f] * theta);
  }
  return nats;
}

std::vector<double> NormalEquations::gain_per_flight() const {
  std::vector<double> nats;
  for (std::size_t f = 0; f < b.size(); ++f) {
    const SmallVector theta = fit_without(f);
    nats.push_back(theta.dot(b[f]) - 0.5 * theta.dot(A[f] * theta));
  }
  return nats;
}

NormalEquations normal_equations(std::span<const Eigen::MatrixXd> grams, std::size_t nuisance, std::size_t columns) {
  const auto q = static_cast<Eigen::Index>(nuisance), p = static_cast<Eigen::Index>(columns);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(q + p + 1, q + p + 1);
  for (const auto& g : grams) sum += g;
  // T maps (nuisance, columns, y) to the columns and y without what the nuisance explains of them.
  Eigen::MatrixXd T = Eigen::MatrixXd::Zero(p + 1, q + p + 1);
  T.rightCols(p + 1).setIdentity();
  if (q > 0) {
    const Eigen::MatrixXd N = sum.topLeftCorner(q, q);
    T.leftCols(q) = -N.completeOrthogonalDecomposition().solve(sum.topRightCorner(q, p + 1)).transpose();
  }
  NormalEquations normal;
  normal.total = SmallMatrix::Zero(p, p);
  for (const auto& g : grams) {
    const Eigen::MatrixXd reduced = T * g * T.transpose();
    normal.A.push_back(reduced.topLeftCorner(p, p));
    normal.b.push_back(reduced.topRightCorner(p, 1));
    normal.total += normal.A.back();
  }
  normal.excited = true;
  for (Eigen::Index k = 0; k < p; ++k)  // all but a trace of the column explained by the nuisance: nothing to learn
    if (!(normal.total(k, k) > kRules.spanned * sum(q + k, q + k)) || !(normal.total(k, k) > kRules.least_square))
      normal.excited = false;
  normal.solvable = normal.excited;
  for (const auto& a : normal.A) {
    SmallMatrix rest = normal.total - a;
    rest.diagonal() *= 1 + kRules.ridge;
    for (Eigen::Index k = 0; k < p; ++k)
      if (!(rest(k, k) > kRules.left_out_share * normal.total(k, k)) || !(rest(k, k) > 0)) normal.solvable = false;
    if (!normal.solvable) break;
    normal.left_out.push_back(rest.inverse());
    if (!normal.left_out.back().allFinite()) normal.solvable = false;
  }
  return normal;
}

}  // namespace backwash::study
