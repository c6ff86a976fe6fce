// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/study/windows/observation.hpp"

namespace backwash::study {

/// Of each flight the first one before it with the same gusts, or its own number. Gusts are chance: what the variances
/// of two flights' windows share beside the model is small however alike they were flown, and all but 1 where one is
/// the other under other stamps, other units or a little noise. Windows are compared by their time since take-off.
std::vector<std::size_t> same_gusts(const Observations& seen);

/// From this correlation of ln variances on two flights are one, over this many values at least.
inline constexpr double kSameGusts = 0.9;
inline constexpr std::size_t kFewestCompared = 30;

}  // namespace backwash::study
