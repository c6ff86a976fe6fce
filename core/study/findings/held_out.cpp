// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/findings/held_out.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <tuple>

#include "core/study/effects/columns.hpp"
#include "core/study/inference/coverage.hpp"
#include "core/study/inference/rivals.hpp"
#include "core/study/inference/rules.hpp"

namespace backwash::study {
namespace {

/// Channels whose scatter is one: the three ln variances, every other one alone.
std::vector<Channel> with_its_like(Channel c) {
  if (std::ranges::count(kVariances, c) > 0) return {kVariances.begin(), kVariances.end()};
  return {c};
}

/// y less what was moved, in some channels.
DesignColumn rest(const Observations& seen, const std::vector<Channel>& channels, const Moved& moved) {
  DesignColumn column;
  for (const Channel c : channels) {
    column.parts.push_back({c, seen.y[c]});
    for (std::size_t i = 0; i < moved[c].size(); ++i) column.parts.back().x[i] -= moved[c][i];
  }
  return column;
}

double square_of(const Evidence& evidence, const DesignColumn& rest, const std::vector<DesignColumn>& nuisance) {
  const NormalEquations normal = evidence.normal({rest}, nuisance);
  return std::max(0.0, normal.total(0, 0));
}

ChannelGain error_of(const Evidence& evidence, Channel channel, const Moved& own,
                     const std::vector<DesignColumn>& nuisance) {
  const Observations& seen = evidence.seen();
  const auto channels = with_its_like(channel);
  double weight = 0;
  std::size_t windows = 0;
  for (const Channel c : channels)
    for (std::size_t i = 0; i < seen.windows.size(); ++i) {
      weight += evidence.weight(c, i) / evidence.scatter(c).within;
      windows += evidence.measured(c, i) && c == channel ? 1 : 0;
    }
  if (!(weight > 0)) return {channel, 0, 0, 0};
  return {channel, std::sqrt(square_of(evidence, rest(seen, channels, {}), nuisance) / weight),
          std::sqrt(square_of(evidence, rest(seen, channels, own), nuisance) / weight), windows};
}

}  // namespace

void add(Moved& moved, std::span<const DesignColumn> columns, const SmallVector& theta, std::size_t begin,
         std::size_t end, const Observations& seen) {
  for (std::size_t k = 0; k < columns.size(); ++k)
    for (const auto& part : columns[k].parts) {
      moved[part.channel].resize(seen.windows.size(), 0);
      for (std::size_t i = begin; i < end; ++i)
        moved[part.channel][i] += theta[static_cast<Eigen::Index>(k)] * part.x[i];
    }
}

Covered covered(const Observations& seen, const Moved& own, const Moved& others) {
  const auto at = [](const Moved& moved, std::size_t c, std::size_t i) { return moved[c].empty() ? 0 : moved[c][i]; };
  Covered share;
  double samples = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t mean = kMeanX + static_cast<std::size_t>(axis), variance = kVarX + static_cast<std::size_t>(axis);
    for (std::size_t i = 0; i < seen.windows.size(); ++i) {
      if (!(seen.weight[variance][i] > 0)) continue;
      const auto& w = seen.windows[i];
      const double m = seen.y[mean][i] - at(others, mean, i), sigma = w.sigma[axis] * std::exp(at(others, variance, i));
      share.before += share_of_interval(m, w.measured_variance[axis], sigma);
      share.after +=
          share_of_interval(m - at(own, mean, i), w.measured_variance[axis], sigma * std::exp(at(own, variance, i)));
      samples += 1;
    }
  }
  if (samples > 0) share = {share.before / samples, share.after / samples};
  return share;
}

std::pair<double, double> interval_of_sum(std::span<const double> parts) {
  const double n = static_cast<double>(parts.size()), sum = std::accumulate(parts.begin(), parts.end(), 0.0);
  double square = 0;
  for (const double x : parts) square += std::pow(x - sum / n, 2);
  const double error = student_975(n - 1) * std::sqrt(square * n / (n - 1));
  return {sum - error, sum + error};
}

Gain held_out(const Evidence& evidence, const std::vector<Accepted>& accepted, std::size_t which) {
  const Observations& seen = evidence.seen();
  const Accepted& cause = accepted[which];
  Gain gain{.held_out_nats = cause.gain};
  if (cause.flights.empty()) return gain;
  std::vector<double> nats;
  for (const auto& flight : cause.flights) nats.push_back(flight.nats);
  std::tie(gain.low_nats, gain.high_nats) = interval_of_sum(nats);

  Moved own, others;
  for (std::size_t f = 0; f < seen.units.size(); ++f)
    add(own, cause.columns, cause.flights[f].theta, seen.units.first[f], seen.units.first[f + 1], seen);
  for (std::size_t j = 0; j < accepted.size(); ++j)
    if (j != which) add(others, accepted[j].columns, accepted[j].theta, 0, seen.windows.size(), seen);
  auto nuisance = nuisance_of(*cause.form, cause.columns, columns_of(accepted, seen, which), seen);
  const auto open = companions(*cause.form, seen);
  nuisance.insert(nuisance.end(), open.begin(), open.end());
  for (const auto& column : cause.columns)
    for (const auto& part : column.parts) {
      const auto channels = with_its_like(part.channel);
      if (std::ranges::any_of(gain.channels,
                              [&](auto& told) { return std::ranges::count(channels, told.channel) > 0; }))
        continue;
      gain.channels.push_back(error_of(evidence, part.channel, own, nuisance));
    }
  gain.rmse_before = gain.channels.front().before;
  gain.rmse_after = gain.channels.front().after;
  const Covered share = covered(seen, own, others);
  gain.coverage_before = share.before;
  gain.coverage_after = share.after;
  return gain;
}

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
