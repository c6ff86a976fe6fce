// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/changes/amplitudes.hpp"

namespace backwash::study {
namespace {

/// Values of columns in a channel, as they are decorrelated; null where a column does not move it.
std::vector<const std::vector<double>*> in_channel(const std::vector<DesignColumn>& columns, Channel channel) {
  std::vector<const std::vector<double>*> moved(columns.size(), nullptr);
  for (std::size_t k = 0; k < columns.size(); ++k)
    for (const auto& part : columns[k].parts)
      if (part.channel == channel) moved[k] = &part.x;
  return moved;
}

}  // namespace

Amplitudes::Amplitudes(const Evidence& evidence, const Form& form, const Scale& scale, const DesignColumn& rest)
    : form_(&form), scale_(scale), units_(&evidence.seen().units) {
  const auto& windows = evidence.seen().windows;
  columns_ = form.columns(windows, scale);
  size_ = evidence.size(columns_);
  std::vector<DesignColumn> all;
  if (!form.constant)
    for (const auto& offset : offsets(columns_, evidence.seen())) all.push_back(decorrelated(offset));
  offsets_ = static_cast<Eigen::Index>(all.size());
  for (const auto& column : columns_) all.push_back(decorrelated(column));
  const auto m = static_cast<Eigen::Index>(all.size()) + 1;
  grams_.setZero(m * m, static_cast<Eigen::Index>(windows.size()));
  Eigen::VectorXd x(m);
  for (const auto& [channel, y, aside] : rest.parts) {
    const auto moved = in_channel(all, channel);
    bool own = false;
    for (std::size_t k = static_cast<std::size_t>(offsets_); k < moved.size(); ++k) own = own || moved[k];
    for (std::size_t i = 0; i < windows.size() && own; ++i) {
      const double w = evidence.weight(channel, i) / evidence.scatter(channel).within;
      if (!(w > 0)) continue;
      for (std::size_t k = 0; k < moved.size(); ++k) x[static_cast<Eigen::Index>(k)] = moved[k] ? (*moved[k])[i] : 0.0;
      x[m - 1] = y[i];
      grams_.col(static_cast<Eigen::Index>(i)) += (w * x * x.transpose()).reshaped();
    }
  }
}

Eigen::MatrixXd Amplitudes::gram(std::size_t begin, std::size_t end) const {
  const auto m = offsets_ + static_cast<Eigen::Index>(columns_.size()) + 1;
  const Eigen::VectorXd sum =
      grams_.middleCols(static_cast<Eigen::Index>(begin), static_cast<Eigen::Index>(end - begin)).rowwise().sum();
  return sum.reshaped(m, m);
}

/// The last parameters of a gram, as many as the form has, the others of it free.
std::optional<Amplitudes::Told> Amplitudes::solved(const Eigen::MatrixXd& gram) const {
  const auto p = static_cast<Eigen::Index>(columns_.size()), free = gram.rows() - 1 - p;
  Eigen::MatrixXd own = gram.bottomRightCorner(p + 1, p + 1);
  if (free > 0) {
    const Eigen::MatrixXd cross = gram.topRightCorner(free, p + 1);
    Eigen::MatrixXd others = gram.topLeftCorner(free, free);  // one heading spans the body's axes
    others.diagonal().array() += kRules.ridge * (others.trace() + 1);
    own -= cross.transpose() * others.ldlt().solve(cross);
  }
  for (Eigen::Index k = 0; k < p; ++k)
    if (!(own(k, k) > kRules.spanned * gram(free + k, free + k)) || !(own(k, k) > kRules.least_square))
      return std::nullopt;
  const SmallMatrix A = own.topLeftCorner(p, p);
  if (!(A.determinant() > kRules.no_turn * std::pow(A.trace(), static_cast<double>(p)))) return std::nullopt;
  const SmallMatrix inverse = A.inverse();
  return Told{inverse * SmallVector(own.topRightCorner(p, 1)), inverse.diagonal()};
}

std::optional<Amplitudes::Told> Amplitudes::level(std::size_t unit) const {
  return begin(unit) == end(unit) ? std::nullopt : solved(gram(begin(unit), end(unit)));
}

std::optional<Amplitudes::Told> Amplitudes::step(std::size_t unit, std::size_t at) const {
  const auto p = static_cast<Eigen::Index>(columns_.size()), q = offsets_;
  const Eigen::MatrixXd before = gram(begin(unit), at), after = gram(at, end(unit)), all = before + after;
  for (const auto& half : {before, after})
    if (!solved(half)) return std::nullopt;
  Eigen::MatrixXd joint(q + 2 * p + 1, q + 2 * p + 1);
  const auto later = after.middleRows(q, p);
  joint.topLeftCorner(q + p, q + p) = all.topLeftCorner(q + p, q + p);
  joint.topRightCorner(q + p, 1) = all.topRightCorner(q + p, 1);
  joint.block(0, q + p, q + p, p) = later.leftCols(q + p).transpose();
  joint.block(q + p, q + p, p, p) = later.middleCols(q, p);
  joint.block(q + p, q + 2 * p, p, 1) = later.rightCols(1);
  joint = joint.selfadjointView<Eigen::Upper>();
  joint(q + 2 * p, q + 2 * p) = all(q + p, q + p);
  return solved(joint);
}

bool Amplitudes::effect(const SmallVector& difference) const {
  return SearchCandidate{form_, form_->cause(), scale_, {}, {}, 0, size_}.effect(difference);
}

}  // namespace backwash::study
