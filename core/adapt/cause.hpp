// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace backwash::adapt {

/// Why errors are larger than promised, as far as the flight tells.
enum class Cause : std::uint8_t {
  none,      ///< they are not
  unknown,   ///< nothing explains them, and it was not flown in a way that tells a late loop from rough air
  constant,  ///< most of it is constant: a load, a push, a trim
  motion,    ///< most of it follows the commanded motion: delay, lag or gains are not those of the vehicle file
  air        ///< what neither explains was refuted too: the air is rougher
};
const char* to_string(Cause cause) noexcept;
/// The same for an operator, as the end of a sentence.
const char* explained(Cause cause) noexcept;

}  // namespace backwash::adapt
