// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/study/effects/structures.hpp"
#include "core/study/inference/evidence.hpp"

namespace backwash::study {

/// A form at a scale, or a structure without a name: something that may explain what the simulation gets wrong.
struct SearchCandidate {
  const Form* form = nullptr;  ///< null for a structure
  std::string name;            ///< of the cause, or of the structure's regressors
  Scale scale;
  std::vector<DesignColumn> columns;
  NormalEquations normal;
  double gain = 0;        ///< held out, nats
  SmallMatrix size;       ///< θᵀ size θ: mean square of what the columns add
  Structure structure{};  ///< of a structure, its functions left out: they are the columns

  /// Whether parameters are an effect at all: at least the stated floor, of the right sign, and possible.
  bool effect(const SmallVector& theta) const { return large_enough(theta) && !beyond_possible(theta); }
  bool large_enough(const SmallVector& theta) const;
  /// The first parameter that no vehicle can have, by its number; nothing of a structure.
  std::optional<std::size_t> beyond_possible(const SmallVector& theta) const;
};

/// Columns that stand beside a form's: free offsets, unless it is one itself, and what was accepted.
std::vector<DesignColumn> nuisance_of(const Form& form, const std::vector<DesignColumn>& columns,
                                      const std::vector<DesignColumn>& accepted, const Observations& seen);

/// Every form of the catalogue that can be tested, at every scale, with the accepted columns as nuisance.
std::vector<SearchCandidate> named_candidates(const Evidence& evidence, const std::vector<DesignColumn>& accepted);
/// Every structure in every group of channels.
std::vector<SearchCandidate> structure_candidates(const Evidence& evidence, const std::vector<DesignColumn>& accepted);
/// A structure's candidate with its further harmonics, as long as each adds kRules.harmonic_nats to the held-out gain.
SearchCandidate with_harmonics(SearchCandidate found, const Evidence& evidence,
                               const std::vector<DesignColumn>& accepted);

/// `flips` rows of ±1 per flight.
std::vector<std::vector<int>> sign_draws(std::size_t flights, int flips, unsigned seed);
/// For each draw the largest gain of a candidate that would count as an effect, sorted; 0 where none gains.
std::vector<double> null_maxima(std::span<const SearchCandidate> all, const std::vector<std::vector<int>>& draws);
/// Share of the null that is at least as large, the data counted.
double p_value(const std::vector<double>& sorted_null, double gain);

}  // namespace backwash::study
