// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace backwash::study {

/// Flights' values that lie on two levels.
struct TwoLevels {
  std::vector<bool> high;  ///< per value
  double p = 1;            ///< of as clear a division by chance, over all divisions tried
  double spread = 0;       ///< of the values about their level, their unit
};

/// The division of values, in the order flown, of which p is least, with two or more values on either side. Tried are:
/// from one flight on; a run of flights; any set of them. Each kind has a third of p, shared by its divisions. t is
/// Student's, its scatter that of the values about their two levels, and at least `least_spread`. Nothing with fewer
/// than six values.
std::optional<TwoLevels> two_levels(const std::vector<double>& values, double least_spread);

/// Windows of one flight, along one amplitude.
struct AmplitudeCourse {
  std::vector<double> value, weight;  ///< per window; weight: 1/variance of its noise, 0 where it is not measured
};

/// Weighted mean and weight of windows [begin, end).
struct Level {
  double value = 0, weight = 0;
};
Level level(const AmplitudeCourse& course, std::size_t begin, std::size_t end);

/// A step within a flight: windows from `at` on lie elsewhere.
struct Step {
  std::size_t at = 0;
  double size = 0;  ///< after less before
  double t = 0;     ///< |size| over its error by the windows' noise
};
/// The step of largest t with at least `fewest` measured windows on either side; none where no place has
/// them.
std::optional<Step> largest_step(const AmplitudeCourse& course, std::size_t fewest);

/// By how much neighbouring windows' likeness multiplies the variance of a mean: 1 + 2 Σ ρ_k, at least 1, about the
/// course's mean; lags 1 … `lags`.
double inflation(const AmplitudeCourse& course, std::size_t lags);

/// Where in a flight the high level begins and ends: windows [begin, end); empty: nowhere.
struct Acting {
  std::size_t begin = 0, end = 0;
};
/// The likeliest of: nowhere, all along, from a window on, up to a window. Both levels may be off by the same random
/// amount of variance `between`; a step costs `price` nats.
Acting acting(const AmplitudeCourse& course, double low, double high, double between, double price, std::size_t fewest);

}  // namespace backwash::study
