// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/evidence.hpp"

#include <cmath>

#include "core/study/inference/rules.hpp"

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

NormalEquations Evidence::normal(const std::vector<DesignColumn>& columns,
                                 const std::vector<DesignColumn>& nuisance) const {
  std::vector<const DesignColumn*> joint;
  joint.reserve(nuisance.size() + columns.size());
  for (const auto& c : nuisance) joint.push_back(&c);
  for (const auto& c : columns) joint.push_back(&c);
  const auto q = static_cast<Eigen::Index>(nuisance.size()), p = static_cast<Eigen::Index>(columns.size());
  const auto G = grams(joint);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(q + p + 1, q + p + 1);
  for (const auto& g : G) sum += g;
  // T maps (nuisance, columns, y) to the columns and y without what the nuisance explains of them.
  Eigen::MatrixXd T = Eigen::MatrixXd::Zero(p + 1, q + p + 1);
  T.rightCols(p + 1).setIdentity();
  if (q > 0) {
    const Eigen::MatrixXd N = sum.topLeftCorner(q, q);
    T.leftCols(q) = -N.completeOrthogonalDecomposition().solve(sum.topRightCorner(q, p + 1)).transpose();
  }
  NormalEquations normal;
  normal.total = SmallMatrix::Zero(p, p);
  for (const auto& g : G) {
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

SmallMatrix Evidence::size(const std::vector<DesignColumn>& columns) const {
  const auto p = static_cast<Eigen::Index>(columns.size());
  SmallMatrix sum = SmallMatrix::Zero(p, p);
  double n = 0;
  SmallVector x(p);
  for (std::size_t c = 0; c < kChannels; ++c) {
    std::vector<const std::vector<double>*> active(columns.size(), nullptr);
    bool moved = false;
    for (std::size_t k = 0; k < columns.size(); ++k)
      for (const auto& part : columns[k].parts)
        if (part.channel == c) {
          active[k] = &part.x;
          moved = true;
        }
    if (!moved) continue;
    for (std::size_t i = 0; i < seen_->windows.size(); ++i) {
      if (!(seen_->weight[c][i] > 0)) continue;
      for (Eigen::Index k = 0; k < p; ++k) {
        const auto* column = active[static_cast<std::size_t>(k)];
        x[k] = column ? (*column)[i] : 0.0;
      }
      sum += seen_->weight[c][i] * x * x.transpose();
      n += seen_->weight[c][i];
    }
  }
  return n > 0 ? SmallMatrix(sum / n) : sum;
}

}  // namespace backwash::study
