// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/findings/held_out.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/study/effects/columns.hpp"
#include "core/study/inference/coverage.hpp"
#include "core/study/inference/rivals.hpp"

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

Gain held_out(const Evidence& evidence, const std::vector<Accepted>& accepted, std::size_t which) {
  const Observations& seen = evidence.seen();
  const Accepted& cause = accepted[which];
  Gain gain{.held_out_nats = cause.gain};
  const double n = static_cast<double>(cause.flights.size());
  if (cause.flights.empty()) return gain;
  double square = 0;
  for (const auto& flight : cause.flights) square += std::pow(flight.nats - cause.gain / n, 2);
  const double error = student_975(n - 1) * std::sqrt(square * n / (n - 1));
  gain.low_nats = gain.held_out_nats - error;
  gain.high_nats = gain.held_out_nats + error;

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

}  // namespace backwash::study
