// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "core/study/windows/observation.hpp"

namespace backwash::study {

/// What a flight's windows say of its gusts.
struct Gusts {
  std::vector<double> t, near;  ///< s since the first row; windows of other flights no farther off are the same one
  std::array<std::vector<double>, 3> y, weight;  ///< of ln variance, per axis
};
Gusts gusts_of(const Observations& seen, std::size_t flight);

/// Of each flight the first one before it with the same gusts, or its own number. Gusts are chance: what the variances
/// of two flights' windows share beside the model is small however alike they were flown, and all but 1 where one is
/// the other under other stamps, other units or a little noise. Windows are compared by their time since take-off
/// (kWindowRules.same_gusts and what follows it), each with each: 0.15 µs a pair of flights of 15 windows.
std::vector<std::size_t> same_gusts(std::vector<Gusts> flights);

}  // namespace backwash::study
