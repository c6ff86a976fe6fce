// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/changes/divisions.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "core/study/windows/signals/distributions.hpp"
#include "core/types/quantile.hpp"

namespace backwash::study {
namespace {

constexpr auto kFewestASide = static_cast<Eigen::Index>(kRules.fewest_a_side.value);

/// Square of the values' scatter, about their median: a few flights that lie elsewhere hardly count in it.
double scatter2(const FlightValues& values) {
  std::vector<double> off;
  for (const auto& row : values.of.rowwise()) {
    const double middle = quantile(std::vector<double>(row.begin(), row.end()), 0.5);
    for (const double x : row) off.push_back(std::abs(x - middle));
  }
  return std::pow(quantile(std::move(off), 0.5) / kRules.normal_75, 2);
}

double noise2(const FlightValues& values) {
  return quantile(std::vector<double>(values.error2.begin(), values.error2.end()), 0.5);
}

/// 1/(error² + scatter² between flights).
Eigen::VectorXd weights(const FlightValues& values) {
  const double between = std::max(0.0, scatter2(values) - noise2(values));
  return (values.error2.array() + between).max(kRules.least_scatter).inverse();
}

/// Weighted regression of the values on profiles beside their mean (or beside nothing).
class Regression {
 public:
  Regression(const FlightValues& values, bool with_mean, const Expected& expected)
      : expected_(expected), weight_(weights(values)), root_(weight_.cwiseSqrt()), with_mean_(with_mean) {
    z_ = values.of * root_.asDiagonal();
    if (with_mean) z_ -= (z_ * root_) / root_.squaredNorm() * root_.transpose();
    total_ = z_.squaredNorm();
    floor_ = weight_.dot(values.error2) / static_cast<double>(weight_.size());
  }

  /// Share of the square that a profile takes, one row.
  double share(const Eigen::RowVectorXd& profile) const {
    const Eigen::RowVectorXd x = reduced(profile);
    const double square = x.squaredNorm();
    return square > kRules.no_turn ? (z_ * x.transpose()).squaredNorm() / square : 0;
  }

  Division division(When when, const Eigen::MatrixXd& profile, double ways) const {
    Division d{when, profile};
    const double n = static_cast<double>(weight_.size()), p = static_cast<double>(z_.rows()),
                 q = static_cast<double>(profile.rows());
    Eigen::MatrixXd x(profile.rows(), profile.cols());
    for (Eigen::Index k = 0; k < x.rows(); ++k) x.row(k) = reduced(profile.row(k));
    const Eigen::MatrixXd inverse = (x * x.transpose()).inverse();
    d.added = z_ * x.transpose() * inverse;
    const double explained = z_.cwiseProduct(d.added * x).sum(),
                 own = p * (n - q - (with_mean_ ? 1 : 0) - (when == When::any ? kRules.level_scatter.value : 0)),
                 left = own + p * expected_.degrees;
    const double rest =
        std::max(total_ - explained, own * floor_) + p * expected_.degrees * floor_ * std::max(1.0, expected_.over);
    d.p = std::min(1.0, ways * r2_tail(explained / (explained + rest), p * q, left));
    d.error = (rest / left * inverse.diagonal().array()).sqrt();
    d.degrees = left;
    d.ways = ways;
    return d;
  }
  /// p of the weaker of two rows of a profile beside the other, over the flights where it may be.
  double weaker(const Division& d) const {
    double most = 0;
    for (Eigen::Index k = 0; k < 2; ++k) {
      const double p = static_cast<double>(d.added.rows()),
                   r = d.added.col(k).squaredNorm() / (d.error[k] * d.error[k]);
      most = std::max(most, static_cast<double>(weight_.size() - 2) * r2_tail(r / (r + d.degrees), p, d.degrees));
    }
    return most;
  }
  /// The level that is added to, and its error.
  void add_level(Division& d, const FlightValues& values) const {
    const Eigen::MatrixXd other = values.of - d.added * d.profile;
    const Eigen::VectorXd still =
        weight_.array() * (1 - d.profile.colwise().sum().transpose().array()).max(0.0);  // flights that lie on it
    const double whole = still.sum() > 0 ? still.sum() : 1;
    d.level = other * still / whole;
    const Eigen::MatrixXd rest = other.colwise() - d.level;
    d.level_error = std::sqrt(std::max(floor_, (rest.array().square().matrix() * weight_).sum() / d.degrees) / whole);
  }

 private:
  Eigen::RowVectorXd reduced(const Eigen::RowVectorXd& profile) const {
    Eigen::RowVectorXd x = profile.cwiseProduct(root_.transpose());
    if (with_mean_) x -= x.dot(root_) / root_.squaredNorm() * root_.transpose();
    return x;
  }

  Expected expected_;
  Eigen::VectorXd weight_, root_;
  bool with_mean_;
  Eigen::MatrixXd z_;
  double total_ = 0, floor_ = 0;
};

Eigen::RowVectorXd between(Eigen::Index flights, Eigen::Index from, Eigen::Index until) {
  Eigen::RowVectorXd profile = Eigen::RowVectorXd::Zero(flights);
  profile.segment(from, until - from).setOnes();
  return profile;
}

/// Flights in the order of their values: of two parameters, along the line on which they scatter most.
std::vector<Eigen::Index> ascending(const Eigen::MatrixXd& values) {
  const Eigen::MatrixXd off = values.colwise() - values.rowwise().mean();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(off * off.transpose());
  const Eigen::RowVectorXd along = axes.eigenvectors().rightCols(1).transpose() * off;
  std::vector<Eigen::Index> order(static_cast<std::size_t>(along.size()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::ranges::stable_sort(order, {}, [&](auto f) { return along[f]; });
  return order;
}

/// The profile of most share among those offered.
struct Clearest {
  const Regression& regression;
  Eigen::RowVectorXd profile{};
  double share = -1;
  void offer(const Eigen::RowVectorXd& other) {
    const double own = regression.share(other);
    if (own <= share) return;
    share = own;
    profile = other;
  }
};

}  // namespace

Expected expected(const std::vector<FlightValues>& amplitudes) {
  std::vector<double> ln;
  for (const auto& values : amplitudes) {
    const double degrees = kRules.median_degrees * static_cast<double>(values.of.size() - values.of.rows());
    const double ratio = scatter2(values) / noise2(values);
    if (ratio > 0 && degrees > 0) ln.push_back(std::log(ratio) - digamma(degrees / 2) + std::log(degrees / 2));
  }
  const double n = static_cast<double>(ln.size());
  if (n < kRules.fewest_divided) return {};
  const double mean = std::accumulate(ln.begin(), ln.end(), 0.0) / n;
  double square = 0, own = 0, most = 0;
  for (const double x : ln) square += (x - mean) * (x - mean) / (n - 1);
  for (const auto& values : amplitudes) {
    const double degrees = static_cast<double>(values.of.size() - values.of.rows());
    own += trigamma(std::max(1.0, kRules.median_degrees * degrees) / 2) / static_cast<double>(amplitudes.size());
    most = std::max(most, 3 * degrees / static_cast<double>(values.of.rows()));
  }
  double degrees = most;  // trigamma(degrees/2) is what varies beyond the scatter's own error
  while (degrees > 1 && trigamma(degrees / 2) < square - own) degrees -= 1;
  return {std::exp(mean + digamma(degrees / 2) - std::log(degrees / 2)), degrees > 1 ? degrees : 0};
}

std::vector<Division> divisions(const FlightValues& values, const Expected& expected) {
  const Eigen::Index n = values.of.cols();
  std::vector<Division> all;
  if (static_cast<double>(n) < kRules.fewest_divided) return all;
  const Regression regression(values, true, expected);
  const double flights = static_cast<double>(n);
  const auto add = [&](When when, const Eigen::MatrixXd& profile, double ways) {
    all.push_back(regression.division(when, profile, ways));
    regression.add_level(all.back(), values);
  };
  Clearest from{regression}, run{regression}, any{regression};
  for (Eigen::Index a = kFewestASide; a + kFewestASide <= n; ++a) from.offer(between(n, a, n));
  for (Eigen::Index a = 1; a < n; ++a)  // from the first one on it is the rest of `from`
    for (Eigen::Index b = a + kFewestASide; b < n; ++b) run.offer(between(n, a, b));
  const auto order = ascending(values.of);
  Eigen::RowVectorXd high = Eigen::RowVectorXd::Zero(n);
  for (Eigen::Index k = n; k-- > kFewestASide;) {
    high[order[static_cast<std::size_t>(k)]] = 1;
    if (n - k >= kFewestASide) any.offer(high);
  }
  add(When::from, from.profile, flights - 1);
  add(When::run, run.profile, (flights - 1) * (flights - 2) / 2);
  add(When::any, any.profile, std::exp2(flights - 1));
  add(When::growing, Eigen::RowVectorXd::LinSpaced(n, 0, 1), 1);
  Eigen::MatrixXd steps(2, n), clearest;
  double least = 2;
  for (Eigen::Index a = kFewestASide; a + 2 * kFewestASide <= n; ++a)
    for (Eigen::Index b = a + kFewestASide; b + kFewestASide <= n; ++b) {
      steps << between(n, a, n), between(n, b, n);
      const double p = regression.division(When::steps, steps, 1).p;
      if (p >= least) continue;
      least = p;
      clearest = steps;
    }
  if (clearest.size() > 0) add(When::steps, clearest, (flights - 1) * (flights - 2) / 2);
  if (clearest.size() > 0 && regression.weaker(all.back()) > kRules.accept_p * kRules.change_share) all.pop_back();
  return all;
}

Division division_of(const FlightValues& values, When when, const Eigen::MatrixXd& profile) {
  const Regression regression(values, true, {});
  Division d = regression.division(when, profile, 1);
  regression.add_level(d, values);
  return d;
}

Division moment(const FlightValues& differences, double ways, const Expected& expected) {
  const Regression regression(differences, false, expected);
  return regression.division(When::moment, Eigen::RowVectorXd::Ones(differences.of.cols()), ways);
}

}  // namespace backwash::study
