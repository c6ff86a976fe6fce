// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/levels/dependence.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <tuple>
#include <utility>

#include "core/types/quantile.hpp"

namespace backwash::study {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr auto kMedianOf = static_cast<Index>(kRules.median_of),
               kMostFeatures = static_cast<Index>(kRules.most_features),
               kMostTurns = static_cast<Index>(kRules.most_turns);
constexpr int kFewestDraws = 32, kMostDraws = 256;  // at a time: their sums fit a processor's cache

double median_distance(const MatrixXd& points) {
  const Index step = 1 + (points.rows() - 1) / kMedianOf;
  std::vector<double> distances;
  for (Index i = 0; i < points.rows(); i += step)
    for (Index j = 0; j < i; j += step)
      if (const double d = (points.row(i) - points.row(j)).norm(); d > kRules.least_square) distances.push_back(d);
  if (distances.empty()) return 1;
  return quantile(std::move(distances), 0.5);
}

/// ΦᵀΨ of each flight with its Ψ turned round, a column a turn; turn 0 is as flown. They are made once where they are
/// few, else when they are asked for: of ten thousand flights they are gigabytes.
class TurnedProducts {
 public:
  TurnedProducts(const MatrixXd& phi, const MatrixXd& psi, const std::vector<std::size_t>& first)
      : phi_(phi), psi_(psi) {
    Index all = 0;
    for (std::size_t f = 0; f + 1 < first.size(); ++f) {
      const auto count = static_cast<Index>(first[f + 1] - first[f]);
      if (count == 0) continue;
      flights_.push_back({static_cast<Index>(first[f]), count, std::min(count, kMostTurns)});
      all += flights_.back().turns * phi.cols() * psi.cols();
    }
    if (all > kMostKept) return;
    for (const Flight& own : flights_) kept_.push_back(made(own));
  }
  std::size_t flights() const { return flights_.size(); }
  Index turns(std::size_t flight) const { return flights_[flight].turns; }
  /// Valid until the next call.
  const MatrixXd& of(std::size_t flight) {
    if (!kept_.empty()) return kept_[flight];
    return asked_ = made(flights_[flight]);
  }

 private:
  struct Flight {
    Index begin, count, turns;
  };
  MatrixXd made(const Flight& own) const {
    const auto [begin, n, turns] = own;
    const auto phi = phi_.middleRows(begin, n), psi = psi_.middleRows(begin, n);
    MatrixXd all(phi.cols() * psi.cols(), turns);
    for (Index j = 0; j < turns; ++j) {
      const Index s = j * n / turns;
      const MatrixXd one =
          phi.topRows(n - s).transpose() * psi.bottomRows(n - s) + phi.bottomRows(s).transpose() * psi.topRows(s);
      all.col(j) = one.reshaped();
    }
    return all;
  }
  static constexpr Index kMostKept = Index{1} << 24;  // numbers: 128 MiB

  const MatrixXd &phi_, &psi_;
  std::vector<Flight> flights_;
  std::vector<MatrixXd> kept_;
  MatrixXd asked_;
};

/// Windows that measure every channel of a group, and where each flight begins among them.
struct GroupRows {
  std::vector<std::size_t> window, first;
};

GroupRows rows_of(const Evidence& evidence, const std::vector<Channel>& group) {
  GroupRows rows;
  const auto& windows = evidence.seen().windows;
  const auto flights = static_cast<double>(evidence.seen().first.size() - 1);
  const auto every = static_cast<std::size_t>(std::ceil(flights / kRules.dependence_flights));
  for (std::size_t i = 0; i < windows.size(); ++i) {
    if (windows[i].flight % every != 0) continue;
    if (!std::all_of(group.begin(), group.end(), [&](Channel c) { return evidence.measured(c, i); })) continue;
    if (rows.window.empty() || windows[rows.window.back()].flight != windows[i].flight)
      rows.first.push_back(rows.window.size());
    rows.window.push_back(i);
  }
  rows.first.push_back(rows.window.size());
  return rows;
}

/// Every other flight's rows, from flight `from` on, and where each of them begins.
std::pair<std::vector<Index>, std::vector<std::size_t>> every_other(const std::vector<std::size_t>& first,
                                                                    std::size_t from) {
  std::pair<std::vector<Index>, std::vector<std::size_t>> half{{}, {0}};
  for (std::size_t f = from; f + 1 < first.size(); f += 2) {
    for (std::size_t i = first[f]; i < first[f + 1]; ++i) half.first.push_back(static_cast<Index>(i));
    half.second.push_back(half.first.size());
  }
  return half;
}

/// Whether both halves of the flights show it by themselves: the drift of one flight is no dependence.
bool in_both_halves(const MatrixXd& phi, const MatrixXd& psi, const std::vector<std::size_t>& first, unsigned seed) {
  for (const std::size_t from : {0u, 1u}) {
    const auto [rows, begins] = every_other(first, from);
    if (rows.empty()) return false;
    const auto test = turn_test(phi(rows, Eigen::all), psi(rows, Eigen::all), begins,
                                static_cast<int>(kRules.shift_draws), static_cast<int>(kRules.enough_turns), seed);
    if (test.p > kRules.dependence_level) return false;
  }
  return true;
}

MatrixXd points_of(const Regressor& along, const Windows& windows, const GroupRows& rows) {
  const auto u = ranks(along, windows);
  MatrixXd points(static_cast<Index>(rows.window.size()), along.circular ? 2 : 1);
  for (Index i = 0; i < points.rows(); ++i) {
    const double value = u[rows.window[static_cast<std::size_t>(i)]];
    if (along.circular)
      points.row(i) << std::cos(value), std::sin(value);
    else
      points(i, 0) = value;
  }
  return points;
}

/// What remains of a group: ln variance moves as one, which is the first of its decorrelated channels.
MatrixXd remainder(const DesignColumn& whitened, const std::vector<Channel>& group, const GroupRows& rows) {
  const std::size_t dimensions = group.front() == kVarX ? 1 : group.size();
  MatrixXd points = MatrixXd::Zero(static_cast<Index>(rows.window.size()), static_cast<Index>(dimensions));
  for (const auto& part : whitened.parts)
    for (std::size_t k = 0; k < dimensions; ++k)
      for (std::size_t i = 0; i < rows.window.size() && part.channel == group[k]; ++i)
        points(static_cast<Index>(i), static_cast<Index>(k)) = part.x[rows.window[i]];
  return points;
}

}  // namespace

MatrixXd kernel_features(const MatrixXd& points) {
  const Index n = points.rows(), most = std::min(n, kMostFeatures);
  const double scale = -0.5 / std::pow(median_distance(points), 2);
  MatrixXd phi = MatrixXd::Zero(n, most);
  Eigen::VectorXd left = Eigen::VectorXd::Ones(n);
  for (Index k = 0; k < most; ++k) {
    Index pivot = 0;
    const double largest = left.maxCoeff(&pivot);
    if (largest < kRules.kernel_error) return phi.leftCols(k);
    const Eigen::VectorXd kernel =
        (scale * (points.rowwise() - points.row(pivot)).rowwise().squaredNorm()).array().exp();
    phi.col(k) = (kernel - phi.leftCols(k) * phi.row(pivot).head(k).transpose()) / std::sqrt(largest);
    left -= phi.col(k).cwiseAbs2();
  }
  return phi;
}

MatrixXd centred(MatrixXd phi, const std::vector<std::size_t>& first) {
  for (std::size_t f = 0; f + 1 < first.size(); ++f) {
    auto own = phi.middleRows(static_cast<Index>(first[f]), static_cast<Index>(first[f + 1] - first[f]));
    if (own.rows() > 0) own.rowwise() -= own.colwise().mean().eval();
  }
  return phi;
}

Independence turn_test(const MatrixXd& phi, const MatrixXd& psi, const std::vector<std::size_t>& first, int shifts,
                       int enough, unsigned seed) {
  TurnedProducts products(phi, psi, first);
  const double n2 = std::pow(static_cast<double>(phi.rows()), 2);
  std::mt19937_64 rng(seed);
  // Draws are summed some hundred at a time, flight by flight: a flight's products are read, or made, once for all of
  // them.
  MatrixXd sums;
  std::vector<Index> turn;
  const auto sum = [&](Index draws) {
    sums.setZero(phi.cols() * psi.cols(), draws);
    for (std::size_t f = 0; f < products.flights(); ++f) {
      const MatrixXd& own = products.of(f);
      for (Index d = 0; d < draws; ++d)
        sums.col(d) += own.col(turn[static_cast<std::size_t>(d) * products.flights() + f]);
    }
  };
  turn.assign(products.flights(), 0);
  sum(1);
  const double hsic = sums.squaredNorm() / n2;
  int above = 1, draw = 0;
  for (int most = kFewestDraws; draw < shifts && above <= enough; most = std::min(2 * most, kMostDraws)) {
    const int now = std::min(most, shifts - draw);
    turn.clear();
    for (int d = 0; d < now; ++d)
      for (std::size_t f = 0; f < products.flights(); ++f)
        turn.push_back(static_cast<Index>((rng() >> 11) % static_cast<std::uint64_t>(products.turns(f))));
    sum(now);
    for (int d = 0; d < now && above <= enough; ++d, ++draw)
      above += sums.col(d).squaredNorm() / n2 >= hsic * (1 - kRules.same) ? 1 : 0;
  }
  return {hsic, above / (1.0 + draw)};
}

std::vector<double> holm(const std::vector<double>& p) {
  std::vector<std::size_t> order(p.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return p[a] < p[b]; });
  std::vector<double> corrected(p.size());
  double least = 0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    least = std::max(least, std::min(1.0, static_cast<double>(p.size() - k) * p[order[k]]));
    corrected[order[k]] = least;
  }
  return corrected;
}

std::vector<Dependence> remaining_dependence(const Evidence& evidence, const std::vector<DesignColumn>& accepted,
                                             unsigned seed, double level) {
  const Observations& seen = evidence.seen();
  DesignColumn everything;
  for (const auto& [name, channels] : channel_groups())
    for (const Channel c : channels) everything.parts.push_back({c, {}});
  std::vector<DesignColumn> explained = offsets({everything}, seen);
  explained.insert(explained.end(), accepted.begin(), accepted.end());
  const DesignColumn whitened = evidence.whitened(explained);
  const auto along_all = regressors(seen);
  const double pairs = static_cast<double>(channel_groups().size() * along_all.size());
  const int draws = static_cast<int>(std::max(kRules.shift_draws.value, std::ceil(2 * pairs / level)));
  std::vector<Dependence> all;
  std::vector<double> p;
  std::vector<char> twice;  // in both halves; asked where p alone would do
  for (const auto& [name, channels] : channel_groups()) {
    const GroupRows rows = rows_of(evidence, channels);
    if (rows.window.empty()) continue;
    const MatrixXd psi = kernel_features(remainder(whitened, channels, rows));
    for (const auto& along : along_all) {
      const MatrixXd phi = centred(kernel_features(points_of(along, seen.windows, rows)), rows.first);
      if (!(phi.squaredNorm() > kRules.constant_regressor)) continue;  // constant within every flight
      const auto test = turn_test(phi, psi, rows.first, draws, static_cast<int>(kRules.enough_turns), seed);
      all.push_back({along.name, name, test.hsic, test.p, 1, false});
      p.push_back(test.p);
      twice.push_back(test.p <= level && in_both_halves(phi, psi, rows.first, seed) ? 1 : 0);
    }
  }
  const auto corrected = holm(p);
  for (std::size_t k = 0; k < all.size(); ++k) {
    all[k].p_holm = corrected[k];
    all[k].found = corrected[k] <= level && twice[k];
  }
  std::stable_sort(all.begin(), all.end(), [](auto& a, auto& b) {
    return std::tuple(!a.found, a.p_holm, a.p) < std::tuple(!b.found, b.p_holm, b.p);
  });
  return all;
}

}  // namespace backwash::study
