// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/study/inference/levels/some_flights.hpp"

namespace backwash::study {

/// The search, beside what acts in some flights only.
struct WholeSearch {
  CauseSearchResult found;
  std::vector<InSomeFlights> some;
  Observations rest;  ///< without those in some flights
};

/// Searches all flights, then flight by flight. Each cause that acts in some flights is taken out of those flights,
/// with what it leaves open, and everything is searched anew, up to most_parts times. Real-time status: offline.
WholeSearch search_all(Observations seen, const CauseSearchOptions& options);

}  // namespace backwash::study
