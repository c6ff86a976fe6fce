// SPDX-License-Identifier: BSD-3-Clause
#include "research/compare/compare_statistics.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <random>

#include "core/types/formatted.hpp"
#include "core/types/quantile.hpp"

namespace backwash::sim {
namespace {

constexpr std::size_t kResamples = 2000;

/// 95 % interval of statistic(indices) over bootstrap samples of n pairs.
template <typename Statistic>
Interval bootstrap(std::size_t n, std::uint64_t seed, const Statistic& statistic) {
  std::mt19937_64 random(seed);
  std::vector<std::size_t> indices(n);
  for (std::size_t i = 0; i < n; ++i) indices[i] = i;
  const double value = statistic(indices);
  if (n < 2) return {value, -std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  std::vector<double> drawn(kResamples);
  for (double& d : drawn) {
    for (auto& i : indices) i = random() % n;
    d = statistic(indices);
  }
  std::ranges::sort(drawn);
  return {value, drawn[kResamples / 40], drawn[kResamples - 1 - kResamples / 40]};
}

bool solved(const RouteOutcome& outcome) { return outcome.status == plan::PlanStatus::ok; }

/// Outcomes of all pairs of all scenes: [method][pair].
using Outcomes = std::vector<std::vector<const RouteOutcome*>>;

Outcomes joined(std::span<const SceneComparison> scenes, std::size_t methods) {
  Outcomes all(methods);
  for (const auto& scene : scenes) {
    assert(scene.outcomes.size() == methods);
    for (std::size_t m = 0; m < methods; ++m)
      for (const auto& outcome : scene.outcomes[m]) all[m].push_back(&outcome);
  }
  return all;
}

template <typename Counts>
MethodRatio ratios(const Outcomes& all, std::size_t method, const Counts& counts, std::uint64_t seed) {
  MethodRatio ratio;
  std::array<std::vector<double>, kMeasures> first, other;
  for (std::size_t n = 0; n < all[0].size(); ++n) {
    if (!counts(n)) continue;
    ratio.pairs += 1;
    for (std::size_t i = 0; i < kMeasures; ++i) {
      first[i].push_back(value(*all[0][n], static_cast<Measure>(i)));
      other[i].push_back(value(*all[method][n], static_cast<Measure>(i)));
    }
  }
  for (std::size_t i = 0; i < kMeasures && ratio.pairs > 0; ++i) {
    ratio.total[i] = ratio_of_totals(first[i], other[i], seed);
    ratio.mean[i] = mean_ratio(first[i], other[i], seed);
  }
  return ratio;
}

void count_flights(MethodRow& row, const std::vector<const RouteOutcome*>& outcomes) {
  std::vector<double> planning;
  row.smallest_clearance_m = std::numeric_limits<double>::infinity();
  for (const auto* o : outcomes) {
    row.pairs += 1;
    row.status[plan::to_string(o->status)] += 1;
    if (!solved(*o)) continue;
    row.solved += 1;
    planning.push_back(o->planning_ms);
    row.flown_m += o->flown_m;
    row.flown_s += static_cast<double>(o->samples - 1) * kControlPeriod;
    row.contacts += o->contacts > 0 ? 1 : 0;
    row.contact_samples += o->contacts;
    row.samples += o->samples;
    row.outside += o->outside;
    row.smallest_clearance_m = std::min(row.smallest_clearance_m, o->clearance_m);
    row.largest_ratio = std::max(row.largest_ratio, o->largest_ratio.maxCoeff());
  }
  if (planning.empty()) return;
  row.planning_ms_median = quantile(planning, 0.5);
  row.planning_ms_p95 = quantile(planning, 0.95);
}

}  // namespace

Interval ratio_of_totals(std::span<const double> a, std::span<const double> b, std::uint64_t seed) {
  assert(a.size() == b.size() && !a.empty());
  return bootstrap(a.size(), seed, [&](const std::vector<std::size_t>& indices) {
    double over = 0, under = 0;
    for (const std::size_t i : indices) {
      over += a[i];
      under += b[i];
    }
    return over / under;
  });
}

Interval mean_ratio(std::span<const double> a, std::span<const double> b, std::uint64_t seed) {
  assert(a.size() == b.size() && !a.empty());
  return bootstrap(a.size(), seed, [&](const std::vector<std::size_t>& indices) {
    double sum = 0;
    for (const std::size_t i : indices) sum += std::log(a[i] / b[i]);
    return std::exp(sum / static_cast<double>(indices.size()));
  });
}

const char* name(Measure measure) {
  const char* const names[kMeasures] = {"length_m",    "time_s",  "jerk2", "jerk2_time5_per_length2",
                                        "flown_jerk2", "energy_J"};
  return names[measure];
}

double value(const RouteOutcome& outcome, Measure measure) {
  switch (measure) {
    case kLength:
      return outcome.planned.length_m;
    case kTime:
      return outcome.planned.time_s;
    case kJerk2:
      return outcome.planned.jerk2;
    case kShape:
      return outcome.planned.jerk2 * std::pow(outcome.planned.time_s, 5) / std::pow(outcome.planned.length_m, 2);
    case kFlownJerk2:
      return outcome.flown_jerk2;
    default:
      return outcome.energy_J;
  }
}

Table tabulate(std::span<const SceneComparison> scenes, const std::vector<CompareMethod>& methods, std::uint64_t seed) {
  const Outcomes all = joined(scenes, methods.size());
  const std::size_t pairs = all[0].size();
  const auto by_all = [&](std::size_t n) {
    return std::ranges::all_of(all, [&](const auto& outcomes) { return solved(*outcomes[n]); });
  };
  const auto eligible = [&](std::size_t n) {
    const auto status = all[0][n]->status;
    return status != plan::PlanStatus::start_blocked && status != plan::PlanStatus::goal_blocked;
  };
  Table table;
  for (std::size_t n = 0; n < pairs; ++n) table.common_pairs += by_all(n) ? 1 : 0;
  for (std::size_t m = 0; m < methods.size(); ++m) {
    MethodRow row;
    row.method = methods[m].name;
    count_flights(row, all[m]);
    for (std::size_t n = 0; n < pairs; ++n) {
      row.eligible += eligible(n) ? 1 : 0;
      row.solved_of_eligible += eligible(n) && solved(*all[m][n]) ? 1 : 0;
      for (std::size_t i = 0; i < kMeasures && by_all(n); ++i)
        row.common[i] += value(*all[m][n], static_cast<Measure>(i));
    }
    row.on_common = ratios(all, m, by_all, seed);
    row.pairwise = ratios(
        all, m, [&](std::size_t n) { return solved(*all[0][n]) && solved(*all[m][n]); }, seed);
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::vector<Demand> demands(const Table& table, const std::vector<CompareMethod>& methods) {
  const MethodRow& first = table.rows.front();
  std::vector<Demand> list = {
      {formatted("no flight touches anything: %zu of %zu did", first.contacts, first.solved), first.contacts == 0},
      {formatted("no sample outside its set: %zu of %zu were", first.outside, first.samples), first.outside == 0}};
  for (std::size_t m = 0; m < methods.size(); ++m) {
    const MethodRow& row = table.rows[m];
    if (!methods[m].margin) continue;
    if (row.contacts > first.contacts) {
      list.push_back({formatted("%s has more contacts: %zu flights", row.method.c_str(), row.contacts), true});
      continue;
    }
    const Interval& jerk2 = row.on_common.total[kJerk2];
    const bool open = row.on_common.pairs > 0 && jerk2.low < 1 && jerk2.high >= 1;
    list.push_back({row.on_common.pairs == 0 ? formatted("jerk2 below %s: no pair that all solve", row.method.c_str())
                    : !jerk2.known()
                        ? formatted("jerk2 below %s: one pair that all solve, ratio %.2f, says nothing of others",
                                    row.method.c_str(), jerk2.value)
                        : formatted("jerk2 below %s%s %zu pairs that all solve: ratio %.2f (%.2f to %.2f)",
                                    row.method.c_str(), open ? " cannot be told with" : " on", row.on_common.pairs,
                                    jerk2.value, jerk2.low, jerk2.high),
                    row.on_common.pairs > 0 && jerk2.high < 1, open || !jerk2.known()});
    const std::size_t without = first.pairs - first.solved, other = row.pairs - row.solved;
    list.push_back({formatted("no path no more often than %s: %zu against %zu of %zu pairs", row.method.c_str(),
                              without, other, row.pairs),
                    without <= other});
  }
  return list;
}

}  // namespace backwash::sim
