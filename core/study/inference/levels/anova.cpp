// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/levels/anova.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "core/study/inference/rules.hpp"

namespace backwash::study {
namespace {

struct Unit {
  std::size_t group;
  double weight, mean;
};
/// σ² of the members' means about those of their groups, by moments: Σw(m − m̄)² = (members − groups) s² + σ² (Σw −
/// Σ_g Σw²/W_g), s²/w the error of a mean. Nothing where each group has one member.
std::optional<double> between_by_moments(const std::vector<Unit>& members, double s2) {
  std::map<std::size_t, Eigen::Array4d> groups;  // Σw, Σwm, Σwm², Σw²
  for (const auto& [group, w, m] : members)
    groups.try_emplace(group, Eigen::Array4d::Zero()).first->second += Eigen::Array4d(w, w * m, w * m * m, w * w);
  if (groups.size() == members.size()) return std::nullopt;
  double square = 0, spread = 0;
  for (const auto& [group, sum] : groups) {
    square += sum[2] - sum[1] * sum[1] / sum[0];
    spread += sum[0] - sum[3] / sum[0];
  }
  return (square - static_cast<double>(members.size() - groups.size()) * s2) / spread;
}

}  // namespace

double built_scatter(Channel c) {
  return c >= kDropout1 ? kRules.dropout_scatter : c >= kMotor1 ? kRules.motor_scatter.value : 0;
}

Scatter anova(Channel c, std::span<const double> r, std::span<const double> weight, const Units& of,
              std::span<const std::size_t> flight_end) {
  double sse = 0, n = 0;
  std::vector<Unit> flights;
  for (std::size_t f = 0; f < of.size(); ++f) {
    for (std::size_t i = of.first[f]; i < of.first[f + 1];) {
      double whole = 0, sum = 0, square = 0, count = 0;
      for (const std::size_t end = flight_end[i]; i < end; ++i) {
        const double w = weight[i];
        whole += w;
        sum += w * r[i];
        square += w * r[i] * r[i];
        count += w > 0 ? 1 : 0;
      }
      if (count == 0) continue;
      sse += square - sum * sum / whole;
      n += count;
      flights.push_back({f, whole, sum / whole});
    }
  }
  // A channel that is exact in every window (no dropout at all) keeps a least scatter.
  const double least = c >= kMotor1 ? kRules.least_rotor_scatter : kRules.least_scatter,
               groups = static_cast<double>(flights.size());
  Scatter found{n > groups ? std::max(sse / (n - groups), least) : 1, 0, 0};
  const double built = built_scatter(c);
  const auto inside = between_by_moments(flights, found.within);  // units of several flights: days
  std::vector<Unit> units;
  if (!inside)
    units = std::exchange(flights, {});
  else
    found.between = std::max(built * built, *inside);
  for (const auto& f : flights) {
    const double w = 1 / (found.within / f.weight + found.between);
    if (units.empty() || units.back().group != f.group) units.push_back({f.group, 0, 0});
    auto& unit = units.back();
    unit.mean += w / (unit.weight + w) * (f.mean - unit.mean);
    unit.weight += w;
  }
  for (auto& unit : units) unit.group = 0;
  const double across = between_by_moments(units, inside ? 1 : found.within).value_or(0);
  if (inside)
    found.units = std::max(0.0, across);
  else
    found.between = std::max(built * built, across);
  return found;
}

}  // namespace backwash::study
