// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace backwash {

/// A time or a duration in nanoseconds, as clocks and stamps have it, in s.
constexpr double seconds(std::int64_t ns) noexcept { return static_cast<double>(ns) * 1e-9; }

}  // namespace backwash
