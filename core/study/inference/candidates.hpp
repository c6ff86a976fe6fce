// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
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
  double gain = 0;         ///< held out, nats, less prior_nats()
  SmallMatrix size;        ///< θᵀ size θ: mean square of what the columns add
  Structure structure{};   ///< of a structure, its functions left out: they are the columns
  double floor = 0;        ///< of a structure: the least root mean square that is an effect
  SmallVector fit{};       ///< (ΣA)⁻¹ Σ b
  std::size_t number = 0;  ///< among all that are tried

  /// Whether parameters are an effect at all: at least the stated floor, of the right sign, and within hard ends.
  bool effect(const SmallVector& theta) const { return large_enough(theta) && !beyond_ends(theta); }
  bool large_enough(const SmallVector& theta) const;
  /// The first parameter beyond what its law can be, by its number; nothing of a structure.
  std::optional<std::size_t> beyond_ends(const SmallVector& theta) const;
  /// What such sizes cost beforehand, nats (Form::prior_nats); 0 of a structure.
  double prior_nats(const SmallVector& theta) const;
};

/// Columns that stand beside a form's: free offsets, unless it is one itself, and what was accepted.
std::vector<DesignColumn> nuisance_of(const Form& form, const std::vector<DesignColumn>& columns,
                                      const std::vector<DesignColumn>& accepted, const Observations& seen);

/// Gives every form of the catalogue that can be tested, at every scale, with the accepted columns as nuisance, to
/// `take`: one after another, for the columns and normal equations of all flights are large.
void each_named(const Evidence& evidence, const std::vector<DesignColumn>& accepted,
                const std::function<void(SearchCandidate&&)>& take);
/// The same of every structure in every group of channels.
void each_structure_candidate(const Evidence& evidence, const std::vector<DesignColumn>& accepted,
                              const std::function<void(SearchCandidate&&)>& take);
/// Without its columns and normal equations.
SearchCandidate outline(SearchCandidate whole);
/// With them again.
SearchCandidate filled(const SearchCandidate& outline, const Evidence& evidence,
                       const std::vector<DesignColumn>& accepted);
/// A structure's candidate with its further harmonics, as long as each adds kRules.harmonic_nats to the held-out gain.
SearchCandidate with_harmonics(SearchCandidate found, const Evidence& evidence,
                               const std::vector<DesignColumn>& accepted);

/// `flips` rows of ±1 per flight.
std::vector<std::vector<int>> sign_draws(std::size_t flights, int flips, unsigned seed);
/// For each draw of signs the largest gain of a candidate that would count as an effect; 0 where none gains.
class NullMaxima {
 public:
  explicit NullMaxima(const std::vector<std::vector<int>>& draws);
  void add(const SearchCandidate& candidate);
  std::vector<double> sorted() const;

 private:
  /// Σ s_f b_f of each draw, a column each: of eight flights the sums of all signs are tabled once.
  Eigen::MatrixXd sums(const NormalEquations& normal) const;

  const std::vector<std::vector<int>>& draws_;
  std::vector<std::vector<std::uint8_t>> signs_;  // of eight flights and each draw: a bit a flight
  std::vector<double> maxima_;
};
/// Share of the null that is at least as large, the data counted.
double p_value(const std::vector<double>& sorted_null, double gain);

}  // namespace backwash::study
