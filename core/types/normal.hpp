// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <numbers>

/// The standard normal distribution.
namespace backwash::normal {

/// z below which the named share of it lies: 0.8, 0.95, 0.975, 0.995.
inline constexpr double k75 = 0.6744898, k95 = 1.644854, k975 = 1.959964, k995 = 2.5758;

/// Share of it below z.
inline double below(double z) noexcept { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

}  // namespace backwash::normal
