// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/discrepancy/evidence.hpp"

#include <cmath>

namespace backwash::study::discrepancy {

SmallVector Normal::fit(const std::vector<int>& signs) const {
  SmallVector sum = SmallVector::Zero(total.rows());
  for (std::size_t f = 0; f < b.size(); ++f) sum += (signs.empty() ? 1 : signs[f]) * b[f];
  return total.ldlt().solve(sum);
}

SmallVector Normal::fit_without(std::size_t flight) const {
  SmallVector sum = SmallVector::Zero(total.rows());
  for (std::size_t f = 0; f < b.size(); ++f)
    if (f != flight) sum += b[f];
  return left_out[flight] * sum;
}

double Normal::gain(const std::vector<int>& signs) const {
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

std::vector<double> Normal::gain_per_flight() const {
  std::vector<double> nats;
  for (std::size_t f = 0; f < b.size(); ++f) {
    const SmallVector theta = fit_without(f);
    nats.push_back(theta.dot(b[f]) - 0.5 * theta.dot(A[f] * theta));
  }
  return nats;
}

Evidence::Evidence(const Observations& seen) : seen_(&seen) { whiten({}); }

void Evidence::anova(Channel c, const std::vector<double>& r) {
  double sse = 0, n = 0, groups = 0, grand = 0, total = 0;
  std::vector<std::pair<double, double>> flights;  // weight, mean
  for (std::size_t f = 0; f + 1 < seen_->first.size(); ++f) {
    double weight = 0, mean = 0, square = 0, count = 0;
    for (std::size_t i = seen_->first[f]; i < seen_->first[f + 1]; ++i) {
      const double w = seen_->weight[c][i];
      if (!(w > 0)) continue;
      weight += w, mean += w * r[i], square += w * r[i] * r[i], count += 1;
    }
    if (count == 0) continue;
    mean /= weight;
    sse += square - weight * mean * mean, n += count, groups += 1;
    flights.emplace_back(weight, mean);
    grand += weight * mean, total += weight;
  }
  // A channel that is exact in every window (no dropout at all) keeps a least scatter.
  const double least = c >= kMotor1 ? 1e-6 : 1e-8;
  within_[c] = n > groups ? std::max(sse / (n - groups), least) : 1;
  // Vehicles are built with rotors and sensors that differ by this much (README.md, "scatter"): no flight averages it
  // out.
  const double built = c >= kDropout1 ? 0.003 : c >= kMotor1 ? 0.01 : 0;
  between_[c] = built * built;
  if (groups < 2) return;
  grand /= total;
  double ssb = 0, squares = 0;
  for (const auto& [weight, mean] : flights)
    ssb += weight * (mean - grand) * (mean - grand), squares += weight * weight;
  between_[c] = std::max(between_[c], (ssb - (groups - 1) * within_[c]) / (total - squares / total));
}

std::vector<Eigen::MatrixXd> Evidence::grams(const std::vector<const Column*>& columns) const {
  const auto p = static_cast<Eigen::Index>(columns.size());
  const std::size_t flights = seen_->first.size() - 1;
  std::vector<Eigen::MatrixXd> grams(flights, Eigen::MatrixXd::Zero(p + 1, p + 1));
  std::vector<std::pair<Eigen::Index, const std::vector<double>*>> active;
  Eigen::MatrixXd outer;
  Eigen::VectorXd sum, x;
  for (std::size_t c = 0; c < kChannels; ++c) {
    active.clear();
    for (Eigen::Index k = 0; k < p; ++k)
      for (const auto& part : columns[static_cast<std::size_t>(k)]->parts)
        if (part.channel == c) active.emplace_back(k, &part.x);
    if (active.empty()) continue;
    active.emplace_back(p, &seen_->y[c]);
    const auto n = static_cast<Eigen::Index>(active.size());
    x.resize(n);
    for (std::size_t f = 0; f < flights; ++f) {
      outer.setZero(n, n), sum.setZero(n);
      double weight = 0;
      for (std::size_t i = seen_->first[f]; i < seen_->first[f + 1]; ++i) {
        const double w = seen_->weight[c][i] / within_[c];
        if (!(w > 0)) continue;
        for (Eigen::Index k = 0; k < n; ++k) x[k] = (*active[static_cast<std::size_t>(k)].second)[i];
        for (Eigen::Index k = 0; k < n; ++k)
          for (Eigen::Index l = 0; l <= k; ++l) outer(k, l) += w * x[k] * x[l];
        sum += w * x, weight += w;
      }
      const double shrink = between_[c] / (1 + between_[c] * weight);
      for (Eigen::Index k = 0; k < n; ++k) {
        for (Eigen::Index l = 0; l <= k; ++l) {
          const double value = outer(k, l) - shrink * sum[k] * sum[l];
          const auto row = active[static_cast<std::size_t>(k)].first,
                     column = active[static_cast<std::size_t>(l)].first;
          grams[f](row, column) += value;
          if (row != column) grams[f](column, row) += value;
        }
      }
    }
  }
  return grams;
}

Normal Evidence::normal(const std::vector<Column>& columns, const std::vector<Column>& nuisance) const {
  std::vector<const Column*> joint;
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
  Normal normal;
  normal.total = SmallMatrix::Zero(p, p);
  for (const auto& g : G) {
    const Eigen::MatrixXd reduced = T * g * T.transpose();
    normal.A.push_back(reduced.topLeftCorner(p, p));
    normal.b.push_back(reduced.topRightCorner(p, 1));
    normal.total += normal.A.back();
  }
  normal.solvable = true;
  for (Eigen::Index k = 0; k < p; ++k)  // all but a trace of the column explained by the nuisance: nothing to learn
    if (!(normal.total(k, k) > 1e-4 * sum(q + k, q + k)) || !(normal.total(k, k) > 1e-9)) normal.solvable = false;
  for (const auto& a : normal.A) {
    SmallMatrix rest = normal.total - a;
    rest.diagonal() *= 1 + 1e-9;
    for (Eigen::Index k = 0; k < p; ++k)
      if (!(rest(k, k) > 0.02 * normal.total(k, k)) || !(rest(k, k) > 0)) normal.solvable = false;
    if (!normal.solvable) break;
    normal.left_out.push_back(rest.inverse());
    if (!normal.left_out.back().allFinite()) normal.solvable = false;
  }
  return normal;
}

void Evidence::whiten(const std::vector<Column>& accepted) {
  within_.fill(1), between_.fill(0);
  std::vector<Column> columns = offsets(accepted, *seen_);
  columns.insert(columns.end(), accepted.begin(), accepted.end());
  Eigen::VectorXd theta;
  if (!columns.empty()) {
    std::vector<const Column*> pointers;
    for (const auto& c : columns) pointers.push_back(&c);
    const auto p = static_cast<Eigen::Index>(columns.size());
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(p + 1, p + 1);
    for (const auto& g : grams(pointers)) sum += g;
    theta = sum.topLeftCorner(p, p).completeOrthogonalDecomposition().solve(sum.topRightCorner(p, 1));
  }
  for (std::size_t c = 0; c < kChannels; ++c) {
    std::vector<double> r = seen_->y[c];
    for (std::size_t k = 0; k < columns.size(); ++k)
      for (const auto& part : columns[k].parts)
        if (part.channel == c)
          for (std::size_t i = 0; i < r.size(); ++i) r[i] -= theta[static_cast<Eigen::Index>(k)] * part.x[i];
    anova(static_cast<Channel>(c), r);
  }
}

SmallMatrix Evidence::size(const std::vector<Column>& columns) const {
  const auto p = static_cast<Eigen::Index>(columns.size());
  SmallMatrix sum = SmallMatrix::Zero(p, p);
  double n = 0;
  SmallVector x(p);
  for (std::size_t c = 0; c < kChannels; ++c) {
    std::vector<const std::vector<double>*> active(columns.size(), nullptr);
    bool moved = false;
    for (std::size_t k = 0; k < columns.size(); ++k)
      for (const auto& part : columns[k].parts)
        if (part.channel == c) active[k] = &part.x, moved = true;
    if (!moved) continue;
    for (std::size_t i = 0; i < seen_->windows.size(); ++i) {
      if (!(seen_->weight[c][i] > 0)) continue;
      for (Eigen::Index k = 0; k < p; ++k) {
        const auto* column = active[static_cast<std::size_t>(k)];
        x[k] = column ? (*column)[i] : 0.0;
      }
      sum += seen_->weight[c][i] * x * x.transpose(), n += seen_->weight[c][i];
    }
  }
  return n > 0 ? SmallMatrix(sum / n) : sum;
}

}  // namespace backwash::study::discrepancy
