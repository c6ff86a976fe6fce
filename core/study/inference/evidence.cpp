// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/evidence.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/study/effects/columns.hpp"
#include "core/study/inference/rules.hpp"
#include "core/study/windows/signals/signals.hpp"

namespace backwash::study {
namespace {

bool is_ln_variance(Channel c) { return c == kVarX || c == kVarY || c == kVarZ; }

}  // namespace

DesignColumn decorrelated(const DesignColumn& column) {
  DesignColumn turned;
  std::array<const std::vector<double>*, 3> axis{};
  std::size_t n = 0;
  for (const auto& part : column.parts) {
    if (is_ln_variance(part.channel)) {
      axis[part.channel - kVarX] = &part.x;
      n = part.x.size();
    } else
      turned.parts.push_back(part);
  }
  if (n == 0) return turned;
  std::array<std::vector<double>, 3> out;
  for (auto& x : out) x.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto at = [&](std::size_t k) { return axis[k] ? (*axis[k])[i] : 0.0; };
    out[0][i] = (at(0) + at(1) + at(2)) / std::sqrt(3.0);
    out[1][i] = (at(0) - at(1)) / std::sqrt(2.0);
    out[2][i] = (at(0) + at(1) - 2 * at(2)) / std::sqrt(6.0);
  }
  for (std::size_t k = 0; k < 3; ++k)
    if (std::any_of(out[k].begin(), out[k].end(), [](double x) { return x != 0; }))
      turned.parts.push_back({static_cast<Channel>(kVarX + k), std::move(out[k])});
  return turned;
}

Evidence::Evidence(const Observations& seen)
    : seen_(&seen), weight_(seen.weight), flight_end_(seen.windows.size(), seen.windows.size()) {
  for (std::size_t f = 0; f < seen.units.size(); ++f)
    for (std::size_t i = seen.units.first[f + 1]; i-- > seen.units.first[f];) {
      const bool last = i + 1 == seen.units.first[f + 1] || seen.windows[i + 1].flight != seen.windows[i].flight;
      flight_end_[i] = last ? i + 1 : flight_end_[i + 1];
    }
  DesignColumn all;
  for (std::size_t c = 0; c < kChannels; ++c) all.parts.push_back({static_cast<Channel>(c), seen.y[c]});
  y_ = decorrelated(all);
  for (std::size_t i = 0; i < seen.windows.size(); ++i) {
    const auto& w = seen.weight;
    const bool whole = w[kVarX][i] > 0 && w[kVarY][i] > 0 && w[kVarZ][i] > 0;
    const double mean = whole ? 3 / (1 / w[kVarX][i] + 1 / w[kVarY][i] + 1 / w[kVarZ][i]) : 0;
    for (const Channel c : {kVarX, kVarY, kVarZ}) weight_[c][i] = mean;
  }
  if (seen.has(Source::attitude)) {
    for (int k = 0; k < 2; ++k) {
      DesignColumn tilt{{{kMeanX, {}}, {kMeanY, {}}}};
      for (const auto& w : seen.windows)
        for (int i = 0; i < 2; ++i) tilt.parts[static_cast<std::size_t>(i)].x.push_back(w.body_axis(k)[i]);
      tilts_.push_back(std::move(tilt));
    }
  }
  whiten({});
}

Evidence Evidence::next(const Observations& flight) const {
  Evidence one(flight);
  one.scatter_ = scatter_;
  one.tilt_ = tilt_;
  one.set_age(age_);
  for (const auto& part : one.y_.parts)
    if (part.channel == kVarX) one.weigh_means(part.x);
  return one;
}

/// Adds one channel's part of every flight's XᵀV⁻¹X, the random trim left aside.
void Evidence::add_channel(std::vector<Eigen::MatrixXd>& grams, Channel c,
                           const std::vector<DesignColumn>& columns) const {
  std::vector<std::pair<Eigen::Index, const std::vector<double>*>> active;
  for (std::size_t k = 0; k < columns.size(); ++k)
    for (const auto& part : columns[k].parts)
      if (part.channel == c) active.emplace_back(static_cast<Eigen::Index>(k), &part.x);
  if (active.empty() || active.front().first + 1 == static_cast<Eigen::Index>(columns.size())) return;  // only y
  const auto n = static_cast<Eigen::Index>(active.size());
  Eigen::MatrixXd outer(n, n);
  Eigen::VectorXd sum(n), x(n), unit_sum(n);
  const auto less = [&](Eigen::MatrixXd& gram, double shrink, const Eigen::VectorXd& of) {
    for (Eigen::Index k = 0; k < n; ++k) {
      for (Eigen::Index l = 0; l <= k; ++l) {
        const double value = outer(k, l) - shrink * of[k] * of[l];
        const auto row = active[static_cast<std::size_t>(k)].first, column = active[static_cast<std::size_t>(l)].first;
        gram(row, column) += value;
        if (row != column) gram(column, row) += value;
      }
    }
  };
  for (std::size_t f = 0; f < grams.size(); ++f) {
    unit_sum.setZero();
    double unit_weight = 0;
    for (std::size_t i = seen_->units.first[f]; i < seen_->units.first[f + 1];) {
      outer.setZero();
      sum.setZero();
      double weight = 0;
      for (const std::size_t end = flight_end_[i]; i < end; ++i) {
        const double w = weight_[c][i] / scatter_[c].within;
        if (!(w > 0)) continue;
        for (Eigen::Index k = 0; k < n; ++k) x[k] = (*active[static_cast<std::size_t>(k)].second)[i];
        for (Eigen::Index k = 0; k < n; ++k)
          for (Eigen::Index l = 0; l <= k; ++l) outer(k, l) += w * x[k] * x[l];
        sum += w * x;
        weight += w;
      }
      const double own = 1 + scatter_[c].between * weight;
      less(grams[f], scatter_[c].between / own, sum);
      unit_sum += sum / own;
      unit_weight += weight / own;
    }
    outer.setZero();
    if (scatter_[c].units > 0) less(grams[f], scatter_[c].units / (1 + scatter_[c].units * unit_weight), unit_sum);
  }
}

std::vector<Eigen::MatrixXd> Evidence::grams(const std::vector<const DesignColumn*>& columns) const {
  std::vector<DesignColumn> all;
  bool level = false;
  for (const DesignColumn* c : columns) {
    all.push_back(decorrelated(*c));
    for (const auto& part : c->parts) level = level || part.channel == kMeanX || part.channel == kMeanY;
  }
  const auto p = static_cast<Eigen::Index>(columns.size());
  const bool trimmed = level && tilt_ > 0;
  if (trimmed) all.insert(all.begin(), tilts_.begin(), tilts_.end());
  all.push_back(y_);
  const Eigen::Index z = trimmed ? 2 : 0;
  std::vector<Eigen::MatrixXd> grams(seen_->units.size(), Eigen::MatrixXd::Zero(z + p + 1, z + p + 1));
  for (std::size_t c = 0; c < kChannels; ++c) add_channel(grams, static_cast<Channel>(c), all);
  if (!trimmed) return grams;
  for (auto& g : grams) {  // Woodbury: V⁻¹ less what the flight's own trim may explain
    const Eigen::Matrix2d own = g.topLeftCorner<2, 2>() + Eigen::Matrix2d::Identity() / tilt_;
    const Eigen::MatrixXd cross = g.topRightCorner(2, p + 1);
    g = (g.bottomRightCorner(p + 1, p + 1) - cross.transpose() * own.ldlt().solve(cross)).eval();
  }
  return grams;
}

NormalEquations Evidence::normal(const std::vector<DesignColumn>& columns,
                                 const std::vector<DesignColumn>& nuisance) const {
  std::vector<const DesignColumn*> joint;
  joint.reserve(free_.size() + nuisance.size() + columns.size());
  for (const auto* some : {&free_, &nuisance, &columns})
    for (const auto& c : *some) joint.push_back(&c);
  return normal_equations(grams(joint), free_.size() + nuisance.size(), columns.size());
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

/// σ_t² by moments: what the flights' own trims β_f scatter about their mean β̄ beyond their errors,
/// E Σ (β_f − β̄)ᵀG_f(β_f − β̄) = 2(F − 1) + σ_t² (tr ΣG − tr (ΣG)⁻¹ΣG²).
double Evidence::trim_scatter(const DesignColumn& residual) const {
  std::vector<DesignColumn> all = tilts_;
  all.push_back(residual);
  std::vector<Eigen::MatrixXd> grams(seen_->units.size(), Eigen::MatrixXd::Zero(3, 3));
  for (const Channel c : {kMeanX, kMeanY}) add_channel(grams, c, all);
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero(), square = sum;
  Eigen::Vector2d moved = Eigen::Vector2d::Zero();
  double flights = 0;
  for (const auto& g : grams) {
    const Eigen::Matrix2d G = g.topLeftCorner<2, 2>();
    if (!(G.determinant() > kRules.no_turn * G.trace() * G.trace())) continue;
    sum += G;
    square += G * G;
    moved += g.topRightCorner<2, 1>();
    flights += 1;
  }
  if (flights < kRules.fewest_trimmed) return 0;
  const Eigen::Vector2d mean = sum.ldlt().solve(moved);
  double spread = 0;
  for (const auto& g : grams) {
    const Eigen::Matrix2d G = g.topLeftCorner<2, 2>();
    if (!(G.determinant() > kRules.no_turn * G.trace() * G.trace())) continue;
    const Eigen::Vector2d off = G.ldlt().solve(g.topRightCorner<2, 1>()) - mean;
    spread += off.dot(G * off);
  }
  return std::max(0.0, (spread - 2 * (flights - 1)) / (sum.trace() - sum.ldlt().solve(square).trace()));
}

/// Weights of the means: of each window's ln variance ratio (mean over the axes), its flight's mean and the share of
/// its own deviation that is not the estimate's error.
void Evidence::weigh_means(const std::vector<double>& ln_variance) {
  double error = 0, count = 0;
  for (const double w : weight_[kVarX])
    if (w > 0) {
      error += 1 / w - kWindowRules.scatter2;
      count += 1;
    }
  if (count == 0) return;
  const double typical =
      static_cast<double>(count) / std::accumulate(weight_[kVarX].begin(), weight_[kVarX].end(), 0.0);
  const double most = kRules.ln_variance_limit;
  const double share = std::clamp(1 - error / count / (scatter_[kVarX].within * typical), 0.0, 1.0);
  for (std::size_t f = 0; f < seen_->units.size(); ++f) {
    double mean = 0, weight = 0;
    for (std::size_t i = seen_->units.first[f]; i < seen_->units.first[f + 1]; ++i) {
      mean += weight_[kVarX][i] * ln_variance[i];
      weight += weight_[kVarX][i];
    }
    if (weight > 0) mean /= weight;
    for (std::size_t i = seen_->units.first[f]; i < seen_->units.first[f + 1]; ++i) {
      const double own = weight_[kVarX][i] > 0 ? share * (ln_variance[i] - mean) : 0;
      const double ln = std::clamp((mean + own) / std::sqrt(3.0), -most, most);
      for (std::size_t k = 0; k < 3; ++k) {
        const double modelled = seen_->windows[i].sigma[static_cast<Eigen::Index>(k)];
        weight_[kMeanX + k][i] = seen_->weight[kMeanX + k][i] * (modelled + kWindowRules.mean_noise) /
                                 (modelled * std::exp(ln) + kWindowRules.mean_noise);
      }
    }
  }
}

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

void Evidence::set_age(double age) {
  for (auto& part : y_.parts)
    for (std::size_t i = 0; i < part.x.size() && part.channel == kCommandDelayH; ++i)
      part.x[i] -= (age - age_) * seen_->windows[i].command_gain[0];
  age_ = age;
}

/// Beside what is accepted; 0 where that spans every delay.
double Evidence::likeliest_age(const std::vector<DesignColumn>& accepted) const {
  const double most = kWindowRules.command_age * seen_->row_period;
  const auto delay = in(kCommandDelayH, seen_->windows, [](auto& w) { return w.command_gain[0]; });
  const NormalEquations alone = normal({delay}, accepted);
  return alone.excited ? std::clamp(age_ + alone.fit()[0], -most, most) : 0;
}

/// Channels of one column differ in their scatter, so the fit that leaves a scatter is weighed by one: first by 1.
void Evidence::whiten(const std::vector<DesignColumn>& accepted) {
  scatter_.fill({1, 0, 0});
  tilt_ = 0;
  std::vector<DesignColumn> columns = offsets(accepted, *seen_);
  columns.insert(columns.end(), accepted.begin(), accepted.end());
  const auto scatter_of = [&](const DesignColumn::Part& r) {
    scatter_[r.channel] = anova(r.channel, r.x, weight_[r.channel], seen_->units, flight_end_);
  };
  for (int round = 0; round < kRules.rounds; ++round) {
    set_age(likeliest_age(accepted));
    const DesignColumn rest = residual(columns);
    for (const auto& r : rest.parts)
      if (r.channel == kVarX) {
        scatter_of(r);
        weigh_means(r.x);
      }
    std::ranges::for_each(rest.parts, scatter_of);
    if (!tilts_.empty()) tilt_ = trim_scatter(rest);
  }
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
