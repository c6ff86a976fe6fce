// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "core/study/effects/columns.hpp"
#include "core/study/inference/evidence.hpp"

namespace backwash::study {

/// y (decorrelated) less what the columns explain of it, by weighted least squares over all flights.
DesignColumn Evidence::residual(const std::vector<DesignColumn>& fitted) const {
  DesignColumn residual = y_;
  std::vector<DesignColumn> columns = free_;
  columns.insert(columns.end(), fitted.begin(), fitted.end());
  if (columns.empty()) return residual;
  std::vector<const DesignColumn*> pointers;
  pointers.reserve(columns.size());
  for (const auto& c : columns) pointers.push_back(&c);
  const auto p = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(p + 1, p + 1);
  for (const auto& g : grams(pointers)) sum += g;
  const Eigen::VectorXd theta =
      sum.topLeftCorner(p, p).completeOrthogonalDecomposition().solve(sum.topRightCorner(p, 1));
  for (std::size_t k = 0; k < columns.size(); ++k)
    for (const auto& part : decorrelated(columns[k]).parts)
      for (auto& r : residual.parts)
        if (r.channel == part.channel)
          for (std::size_t i = 0; i < r.x.size(); ++i) r.x[i] -= theta[static_cast<Eigen::Index>(k)] * part.x[i];
  return residual;
}

std::vector<double> Evidence::ln_likelihood(const std::vector<DesignColumn>& accepted) const {
  DesignColumn every;
  for (std::size_t c = kMeanX; c <= kVarZ; ++c) every.parts.push_back({static_cast<Channel>(c), {}});
  std::vector<DesignColumn> columns = offsets({every}, *seen_);
  columns.insert(columns.end(), accepted.begin(), accepted.end());
  std::vector<DesignColumn> rest{residual(columns)};
  if (tilt_ > 0) rest.insert(rest.begin(), tilts_.begin(), tilts_.end());
  rest.push_back(rest.back());
  const auto z = static_cast<Eigen::Index>(rest.size()) - 2;
  std::vector<Eigen::MatrixXd> grams(seen_->units.size(), Eigen::MatrixXd::Zero(z + 2, z + 2));
  std::vector<double> nats(grams.size(), 0);
  for (std::size_t c = 0; c < kChannels; ++c) {
    add_channel(grams, static_cast<Channel>(c), rest);
    for (std::size_t f = 0; f < nats.size(); ++f) {
      double units = 0;
      for (std::size_t i = seen_->units.first[f]; i < seen_->units.first[f + 1];) {
        double weight = 0;
        for (const std::size_t end = flight_end_[i]; i < end; ++i) {
          const double w = weight_[c][i] / scatter_[c].within;
          if (w > 0) nats[f] += std::log(w) / 2;
          weight += w;
        }
        const double own = 1 + scatter_[c].between * weight;
        nats[f] -= std::log(own) / 2;
        units += weight / own;
      }
      nats[f] -= std::log1p(scatter_[c].units * units) / 2;
    }
  }
  for (std::size_t f = 0; f < nats.size(); ++f) {
    double square = grams[f](z, z);
    if (z > 0) {  // Woodbury, as in grams()
      const Eigen::Matrix2d own = grams[f].topLeftCorner<2, 2>() + Eigen::Matrix2d::Identity() / tilt_;
      const Eigen::Vector2d cross = grams[f].block<2, 1>(0, z);
      square -= cross.dot(own.ldlt().solve(cross));
      nats[f] -= std::log((own * tilt_).determinant()) / 2;
    }
    nats[f] -= square / 2;
  }
  return nats;
}

/// Takes each flight's mean out of every channel, and with the level means' its own trim, ridge 1/σ_t².
void Evidence::take_flights_out(DesignColumn& residual) const {
  const bool trimmed = tilt_ > 0;
  for (std::size_t f = 0; f < seen_->units.size(); ++f) {
    Eigen::Matrix4d normal = Eigen::Vector4d(0, 0, trimmed ? 1 / tilt_ : 1, trimmed ? 1 / tilt_ : 1).asDiagonal();
    Eigen::Vector4d moved = Eigen::Vector4d::Zero();
    const auto design = [&](Channel c, std::size_t i) {
      Eigen::Vector4d d(c == kMeanX, c == kMeanY, 0, 0);
      for (std::size_t k = 0; k < 2 && trimmed; ++k)
        d[static_cast<Eigen::Index>(2 + k)] = tilts_[k].parts[c == kMeanX ? 0 : 1].x[i];
      return d;
    };
    for (auto& [c, x, aside] : residual.parts) {
      double mean = 0, weight = 0;
      for (std::size_t i = seen_->units.first[f]; i < seen_->units.first[f + 1]; ++i) {
        const double w = weight_[c][i] / scatter_[c].within;
        mean += w * x[i];
        weight += w;
        if (c > kMeanY || !(w > 0)) continue;
        const Eigen::Vector4d d = design(c, i);
        normal += w * d * d.transpose();
        moved += w * x[i] * d;
      }
      if (c <= kMeanY || !(weight > 0)) continue;
      for (std::size_t i = seen_->units.first[f]; i < seen_->units.first[f + 1]; ++i) x[i] -= mean / weight;
    }
    const Eigen::Vector4d own = normal.completeOrthogonalDecomposition().solve(moved);
    for (auto& [c, x, aside] : residual.parts)
      for (std::size_t i = seen_->units.first[f]; i < seen_->units.first[f + 1] && c <= kMeanY; ++i)
        x[i] -= own.dot(design(c, i));
  }
}

DesignColumn Evidence::whitened(const std::vector<DesignColumn>& columns) const {
  DesignColumn rest = residual(columns);
  take_flights_out(rest);
  for (auto& [c, x, aside] : rest.parts)
    for (std::size_t i = 0; i < x.size(); ++i) x[i] *= std::sqrt(weight_[c][i] / scatter_[c].within);
  return rest;
}

}  // namespace backwash::study
