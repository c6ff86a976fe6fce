// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <utility>
#include <vector>

#include "core/types/quantile.hpp"

namespace backwash::log {

/// The middle value, of an even count the upper one of the two. Needs one at least.
inline double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

}  // namespace backwash::log
