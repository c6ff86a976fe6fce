// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>

#include "core/sync/atomic_optional.hpp"

namespace backwash::daemon {

/// CLOCK_MONOTONIC, ns.
inline std::int64_t now_ns() noexcept {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

/// When something was done, CLOCK_MONOTONIC, ns; none: not yet.
using AtomicTime = sync::AtomicOptional<std::int64_t, INT64_MIN>;

}  // namespace backwash::daemon
