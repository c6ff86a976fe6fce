// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/before_after/before_after.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "core/study/before_after/before_after_rules.hpp"
#include "core/study/windows/signals/distributions.hpp"

namespace backwash::study {
namespace {

/// For each flight the first one that it is joined to by cells that both flew; those without values stay alone.
std::vector<std::size_t> joined_by_cells(const FlightMeasure& measure, std::size_t flights) {
  std::vector<std::size_t> root(flights);
  std::iota(root.begin(), root.end(), std::size_t{0});
  const auto find = [&](std::size_t f) {
    while (root[f] != f) f = root[f];
    return f;
  };
  std::map<Cell, std::size_t> flown;
  for (const auto& v : measure.values) {
    const auto [at, first] = flown.try_emplace(v.cell, v.flight);
    const std::size_t here = find(v.flight), there = find(at->second);
    root[std::max(here, there)] = std::min(here, there);
  }
  for (std::size_t f = 0; f < flights; ++f) root[f] = find(f);
  return root;
}

struct Side {
  double n = 0, mean = 0, variance = 0;  ///< of units
};

Side side_of(const std::map<std::size_t, std::pair<double, double>>& units) {
  Side side;
  side.n = static_cast<double>(units.size());
  for (const auto& [unit, sum] : units) side.mean += sum.first / sum.second / side.n;
  for (const auto& [unit, sum] : units)
    side.variance += std::pow(sum.first / sum.second - side.mean, 2) / std::max(side.n - 1, 1.0);
  return side;
}

/// Quantiles of the error of a difference, at the level of one measure of `many`: of what is told, and with power.
double told_at(double degrees, double many) {
  return student_quantile(1 - kBeforeAfterRules.told_level / (2 * many), degrees);
}
double shown_at(double degrees, double many) {
  return told_at(degrees, many) + student_quantile(kBeforeAfterRules.told_power, degrees);
}

std::optional<int> needed(double variances, double size, double many) {
  for (int n = 2; n <= static_cast<int>(kBeforeAfterRules.most_needed); ++n)
    if (shown_at(2.0 * n - 2, many) * std::sqrt(variances / n) <= size) return n;
  return std::nullopt;
}

void judge(MeasuredChange& told, const Side& before, const Side& after, double many) {
  const bool ratio = told.measure->ratio;
  const auto in_unit = [&](double y) { return ratio ? std::exp(y) : y; };
  const double vb = before.variance / before.n, va = after.variance / after.n, error = std::sqrt(vb + va);
  const double degrees =
      error > 0 ? std::pow(vb + va, 2) / (vb * vb / (before.n - 1) + va * va / (after.n - 1)) : before.n + after.n - 2;
  const double difference = after.mean - before.mean, width = told_at(degrees, many) * error;
  told.before = in_unit(before.mean);
  told.after = in_unit(after.mean);
  told.change = in_unit(difference);
  told.low = in_unit(difference - width);
  told.high = in_unit(difference + width);
  told.smallest = in_unit(shown_at(degrees, many) * error);
  const double size = ratio ? std::log1p(kBeforeAfterRules.worth) : kBeforeAfterRules.worth * std::abs(before.mean);
  told.needed = needed(before.variance + after.variance, size, many);
  if (difference + width < 0) told.helped = Helped::better;
  if (difference - width > 0) told.helped = Helped::worse;
}

}  // namespace

const char* to_string(Helped helped) noexcept {
  constexpr const char* kNames[] = {"better", "worse", "cannot_be_told"};
  return kNames[static_cast<std::size_t>(helped)];
}

std::vector<std::optional<double>> flight_levels(const FlightMeasure& measure, std::size_t flights) {
  std::vector<std::optional<double>> levels(flights);
  if (measure.values.empty()) return levels;
  const auto root = joined_by_cells(measure, flights);
  std::map<std::size_t, std::vector<std::size_t>> sets;  // flights with values, by their root
  for (const auto& v : measure.values)
    if (auto& set = sets[root[v.flight]]; set.empty() || set.back() != v.flight) set.push_back(v.flight);
  const auto& most = std::ranges::max_element(sets, {}, [](auto& s) { return s.second.size(); })->second;
  std::map<std::size_t, Eigen::Index> place;
  for (const std::size_t f : most) place.emplace(f, static_cast<Eigen::Index>(place.size()));
  std::map<Cell, Eigen::Index> cells;
  for (const auto& v : measure.values)
    if (place.contains(v.flight)) cells.emplace(v.cell, static_cast<Eigen::Index>(cells.size()));
  Eigen::MatrixXd count = Eigen::MatrixXd::Zero(std::ssize(place), std::ssize(cells));
  Eigen::VectorXd of_flight = Eigen::VectorXd::Zero(count.rows()), of_cell = Eigen::VectorXd::Zero(count.cols());
  for (const auto& v : measure.values) {
    const auto found = place.find(v.flight);
    if (found == place.end()) continue;
    const auto c = cells.at(v.cell);
    count(found->second, c) += 1;
    of_flight[found->second] += v.y;
    of_cell[c] += v.y;
  }
  // Normal equations of y = level + cell with the cells eliminated; their null space is one constant.
  const Eigen::VectorXd flown = count.colwise().sum();
  const Eigen::MatrixXd shares = count * flown.cwiseInverse().asDiagonal();
  Eigen::MatrixXd normal = -shares * count.transpose();
  normal.diagonal() += count.rowwise().sum();
  normal.array() += 1;
  const Eigen::VectorXd level = normal.ldlt().solve(of_flight - shares * of_cell);
  const double cell_mean = (of_cell.sum() - level.dot(count.rowwise().sum())) / flown.sum();
  for (const auto& [flight, at] : place) levels[flight] = level[at] + cell_mean;
  return levels;
}

std::vector<MeasuredChange> before_after(const std::vector<FlightMeasure>& measures, const std::vector<char>& after,
                                         const std::vector<std::size_t>& unit) {
  std::vector<MeasuredChange> all;
  std::vector<std::array<Side, 2>> sides;
  double many = 0;
  for (const auto& measure : measures) {
    auto& told = all.emplace_back(MeasuredChange{&measure});
    const auto levels = flight_levels(measure, after.size());
    std::array<std::map<std::size_t, std::pair<double, double>>, 2> units;
    for (std::size_t f = 0; f < after.size(); ++f) {
      if (!levels[f]) continue;
      (after[f] ? told.flights_after : told.flights_before) += 1;
      auto& [sum, count] = units[after[f] ? 1 : 0][unit[f]];
      sum += *levels[f];
      count += 1;
    }
    sides.push_back({side_of(units[0]), side_of(units[1])});
    if (std::min(units[0].size(), units[1].size()) >= 2)
      many += 1;
    else
      told.why = std::to_string(units[0].size()) + " before and " + std::to_string(units[1].size()) +
                 " after have it at the same distances and speeds; 2 or more of each are needed";
  }
  for (std::size_t k = 0; k < all.size(); ++k)
    if (all[k].why.empty()) judge(all[k], sides[k][0], sides[k][1], many);
  return all;
}

std::string verdict_of(const std::vector<MeasuredChange>& changes) {
  const auto some = [&](Helped helped) {
    return std::ranges::any_of(changes, [&](auto& c) { return c.helped == helped; });
  };
  if (some(Helped::better) && some(Helped::worse)) return "better_and_worse";
  return to_string(some(Helped::better)  ? Helped::better
                   : some(Helped::worse) ? Helped::worse
                                         : Helped::cannot_be_told);
}

}  // namespace backwash::study
