// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/study/inference/changes/divisions.hpp"
#include "core/study/inference/search.hpp"

namespace backwash::study {

/// A flight in which a cause acts: all along, or from and up to a moment, s since its first row.
struct ActingFlight {
  std::size_t flight = 0;  ///< number among the observed flights, from 0
  std::optional<double> since_s = {}, until_s = {};
};

/// A cause that does not act in all flights alike.
struct Change {
  Accepted found;  ///< its columns are 0 where it does not act; its gain is against no change
  When when;
  std::vector<ActingFlight> flights;    ///< ascending
  std::vector<DesignColumn> open = {};  ///< what it leaves open (Form::companions), 0 where it does not act; of rotors,
                                        ///< how the craft is built
};

/// The likeliest changes beside the accepted causes, of at most most_causes causes, the likeliest first (docs/model.md
/// section 8, "When"); two changes of one cause where it acts in two steps. Family-wise over causes, forms, scales and
/// times; nothing beyond change_share of accept_p. Not told: what the forms of those `known` already may leave.
std::vector<std::vector<Change>> likeliest_changes(const Evidence& evidence, const std::vector<Accepted>& accepted,
                                                   const std::vector<Change>& known, const CauseSearchOptions& options);

}  // namespace backwash::study
