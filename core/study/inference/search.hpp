// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/study/inference/evidence.hpp"
#include "core/study/inference/intervals.hpp"
#include "core/study/inference/rules.hpp"

namespace backwash::study {

struct SearchOptions {
  int flips = static_cast<int>(kRules.flips);  ///< sign draws of the null
  double accept_p = kRules.accept_p;           ///< family-wise, nominal; confusion.md says what it comes to
  unsigned seed = 1;
  std::size_t most_causes = static_cast<std::size_t>(kRules.most_causes);
  std::function<void(const std::string&)> progress = [](const std::string&) {};
};

/// A form at a scale, or a smooth along a regressor: something that may explain what the simulation gets wrong.
struct Candidate {
  const Form* form = nullptr;  ///< null for a smooth
  std::string name;            ///< of the cause or of the regressor
  Scale scale;
  std::vector<Column> columns;
  Normal normal;
  double gain = 0;   ///< held out, nats
  SmallMatrix size;  ///< θᵀ size θ: mean square of what the columns add

  /// Whether parameters are an effect at all: at least the stated floor, and of a possible sign.
  bool effect(const SmallVector& theta) const;
};

struct Rival {
  std::string name;
  const Form* form;
  Scale scale;
  double behind_nats;  ///< gain of the accepted cause less the rival's
};

struct Accepted {
  const Form* form;
  Scale scale;
  std::vector<Column> columns;
  SmallVector theta;
  double p;
  double gain;  ///< held out, nats, given the other accepted causes
  std::vector<Estimate> parameters;
  std::vector<Rival> rivals;
};

struct UnknownStructure {
  std::string along;  ///< regressor
  std::string group;  ///< channels: "mean x", "mean y", "mean z", "ln variance"
  double p, gain;
};

struct SearchResult {
  std::vector<Accepted> accepted;  ///< in the order found
  std::vector<UnknownStructure> unknown;
  double threshold = 0;           ///< nats that the null exceeds with probability accept_p, last step
  std::vector<double> null_gain;  ///< sorted maxima of the last step
};

/// Greedy search under the null of whole flights' signs flipped (core/study/README.md says the rules).
SearchResult search(const Evidence& evidence, const SearchOptions& options);

/// All that can be tested, with the accepted columns as nuisance; catalogue first, then the smooths.
std::vector<Candidate> candidates(const Evidence& evidence, const std::vector<Column>& accepted, bool smooths);
/// `flips` rows of ±1 per flight.
std::vector<std::vector<int>> sign_draws(std::size_t flights, int flips, unsigned seed);

}  // namespace backwash::study
