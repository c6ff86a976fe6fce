// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "core/study/inference/search.hpp"

namespace backwash::study {

/// A flight in which a cause acts: all along, or from and up to a moment, s since its first row.
struct ActingFlight {
  std::size_t flight = 0;  ///< number among the observed flights, from 0
  std::optional<double> since_s = {}, until_s = {};
};

/// A cause that acts in some flights and not in the others.
struct InSomeFlights {
  Accepted found;                       ///< its columns are 0 where it does not act
  std::vector<ActingFlight> flights;    ///< ascending
  std::vector<DesignColumn> open = {};  ///< what it leaves open (Form::companions), 0 where it does not act
};

/// The clearest cause, of the constants of the craft (Form::constant) that its rotors' own channels tell, that some
/// flights have and others have not, after the accepted ones. Two routes share the level: flights' own amplitudes lie
/// on two levels (two_levels.hpp), or one flight's windows do. p is family-wise over all causes, rotors, divisions and
/// steps. Nothing beyond accept_p × some_level. Not told: what the forms of those `known` already may leave.
std::optional<InSomeFlights> in_some_flights(const Evidence& evidence, const CauseSearchResult& found,
                                             const std::vector<InSomeFlights>& known,
                                             const CauseSearchOptions& options);

}  // namespace backwash::study
