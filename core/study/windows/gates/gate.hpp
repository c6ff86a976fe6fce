// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace backwash::study {

/// Why a window was left out.
enum class Gate : std::size_t {
  frozen,        ///< measurements repeat themselves: a tracker or estimator that has stopped
  perched,       ///< standing on something: no motion at all, thrust far below the log's hover, or rotors told to rest
  saturated,     ///< rotors at a limit: the acceleration is then not the command's and the air's alone
  transit,       ///< on the way between hover positions, or settling after it
  gap,           ///< rows are missing
  inconsistent,  ///< position and velocity, or map and log, contradict each other
  outside,       ///< out of sight of the map
};
/// The first of them, which windows of hover know.
inline constexpr std::size_t kHoverGates = 5;
const char* to_string(Gate gate) noexcept;

/// By their names, as they are listed.
struct ByName {
  bool operator()(Gate a, Gate b) const noexcept;
};

}  // namespace backwash::study
