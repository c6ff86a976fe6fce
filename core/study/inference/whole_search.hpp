// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/study/inference/changes/changes.hpp"

namespace backwash::study {

/// The search, beside what does not act in all flights alike.
struct WholeSearch {
  CauseSearchResult found;
  std::vector<Change> changes;
  Observations rest;  ///< without the changes
  /// Of the rest, what the changes leave open free: no other cause may claim it.
  Evidence evidence() const;
};

/// Searches all flights for causes, then for the likeliest change beside them and instead of them. A change that makes
/// the flights likelier, with all that is found beside it, is taken out, what it leaves open stays free, and everything
/// is searched anew, up to most_parts times. Real-time status: offline.
WholeSearch search_all(Observations seen, const CauseSearchOptions& options);

}  // namespace backwash::study
