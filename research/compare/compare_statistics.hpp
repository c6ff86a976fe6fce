// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "research/compare/compare.hpp"

namespace backwash::sim {

/// A value with its 95 % interval: everything, from −∞ to ∞, where one pair says nothing about others.
struct Interval {
  double value, low, high;
  bool known() const { return std::isfinite(low) && std::isfinite(high); }
};

/// Ratio of totals Σ a / Σ b over pairs, and its percentile interval from 2,000 seeded bootstrap samples of the pairs.
/// Precondition: equal sizes, not empty, b > 0.
Interval ratio_of_totals(std::span<const double> a, std::span<const double> b, std::uint64_t seed);
/// Geometric mean of a_i / b_i and its interval in the same way: each pair weighs the same. Precondition: a, b > 0.
Interval mean_ratio(std::span<const double> a, std::span<const double> b, std::uint64_t seed);

/// What Table I compares on pairs that several methods solve.
/// kShape is jerk²·time⁵/length², which neither speed nor scale changes: 720 on a straight line at least jerk, rest to
/// rest. Twice the time makes jerk² 32 times less, so that jerk² alone rewards slow plans.
enum Measure : std::size_t { kLength, kTime, kJerk2, kShape, kFlownJerk2, kEnergy, kMeasures };
const char* name(
    Measure measure);  ///< "length_m", "time_s", "jerk2", "jerk2_time5_per_length2", "flown_jerk2", "energy_J"
double value(const RouteOutcome& outcome, Measure measure);

/// The first method over another on the pairs that count for both.
struct MethodRatio {
  std::size_t pairs = 0;
  std::array<Interval, kMeasures> total, mean;  ///< zero where there are no pairs
};

/// One row of Table I.
struct MethodRow {
  std::string method;
  std::size_t pairs = 0, solved = 0;
  std::map<std::string, std::size_t> status;  ///< pairs by status
  /// Pairs whose ends the first method finds hover-safe, and how many of them this one solves.
  std::size_t eligible = 0, solved_of_eligible = 0;
  double flown_m = 0, flown_s = 0;                ///< all flights
  std::size_t contacts = 0, contact_samples = 0;  ///< flights with contact; samples
  std::size_t samples = 0, outside = 0;
  double smallest_clearance_m = 0;                     ///< body to obstacle, all flights
  double largest_ratio = 0;                            ///< |e|/h on any axis, all flights
  double planning_ms_median = 0, planning_ms_p95 = 0;  ///< of solved pairs
  std::array<double, kMeasures> common{};              ///< totals over the pairs that all methods solve
  MethodRatio on_common;                               ///< first method over this one, pairs that all solve
  MethodRatio pairwise;                                ///< the same, pairs that these two solve
};

struct Table {
  std::size_t common_pairs = 0;
  std::vector<MethodRow> rows;  ///< in the order of the methods
};
/// Table over any number of scenes. The first method is the one that the others are held against. Precondition: each
/// scene has the outcomes of all methods.
Table tabulate(std::span<const SceneComparison> scenes, const std::vector<CompareMethod>& methods, std::uint64_t seed);

/// What the comparison demands of the first method, and what came out.
struct Demand {
  std::string text;
  bool met;
  bool open = false;  ///< not met, and not missed: these pairs cannot tell
};
/// No contacts, no sample outside its set, and against every margin with no more contacts: jerk² lower on the pairs
/// that all solve (the whole interval of the ratio of totals below 1), no-path no more often.
std::vector<Demand> demands(const Table& table, const std::vector<CompareMethod>& methods);

}  // namespace backwash::sim
