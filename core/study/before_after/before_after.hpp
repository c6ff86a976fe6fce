// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/study/before_after/measures.hpp"

namespace backwash::study {

enum class Helped : std::uint8_t { better, worse, cannot_be_told };
const char* to_string(Helped helped) noexcept;

/// What a change did to one measure: ratios, or differences in the measure's unit.
struct MeasuredChange {
  const FlightMeasure* measure;
  std::size_t flights_before = 0, flights_after = 0;  ///< that have it, and share a cell with the others
  double before = 0, after = 0;                       ///< means over flights, in the measure's unit
  double change = 0, low = 0, high = 0;               ///< after over before, or after less before, and its interval
  double smallest = 0;             ///< the change that these flights would show four times in five, or its difference
  std::optional<int> needed = {};  ///< flights a side that would show a change of a tenth; none: more than most_needed
  std::string why = {};            ///< why there is no change to tell; empty: there is one
  Helped helped = Helped::cannot_be_told;
};

/// Levels of the flights that place and speed do not explain (docs/model.md 8-14), by flight; nothing for those with
/// too few windows, or that share no cell with the largest set of flights which do.
std::vector<std::optional<double>> flight_levels(const FlightMeasure& measure, std::size_t flights);

/// Each measure's change with an interval over flights (8-15), such that anything at all is told of flights that differ
/// in nothing with the probability `told_level`. `after`: of each flight whether it was flown after the change. `unit`:
/// flights with the same number and side count as one (flights of a day). O(flights³).
std::vector<MeasuredChange> before_after(const std::vector<FlightMeasure>& measures, const std::vector<char>& after,
                                         const std::vector<std::size_t>& unit);

/// "better", "worse", "better_and_worse" or "cannot_be_told" of all measures.
std::string verdict_of(const std::vector<MeasuredChange>& changes);

}  // namespace backwash::study
