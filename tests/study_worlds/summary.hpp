// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "tests/study_worlds/score.hpp"

namespace study_worlds {

/// Hits among trials with Wilson's 95 % interval.
struct Rate {
  int hits = 0, n = 0;
  void count(bool hit) {
    hits += hit ? 1 : 0;
    ++n;
  }
  void add(const Rate& other) {
    hits += other.hits;
    n += other.n;
  }
  double low() const;
  double high() const;
};

/// What the outcomes of one cell add up to.
struct CellSummary {
  std::string cell;
  Rate right, in_sets, wrong_name, silent, ambiguous;
  Rate covered;                                   ///< parameters whose interval holds the truth in the table's unit
  Rate covered_best;                              ///< and those whose interval holds the best value of their form
  std::vector<double> errors, gain_shares;        ///< sorted
  std::vector<std::pair<int, std::string>> told;  ///< most frequent first
};
std::vector<CellSummary> summarise(const std::vector<WorldOutcome>& outcomes);

/// One requirement over cells, its figure and whether it holds.
struct Requirement {
  std::string name, figure;
  bool held;
};
std::vector<Requirement> gates(const std::vector<CellSummary>& cells);

/// Tables of confusion.md: confusion, figures, gates.
std::string markdown(const std::vector<CellSummary>& cells, const std::vector<WorldOutcome>& outcomes);

}  // namespace study_worlds
