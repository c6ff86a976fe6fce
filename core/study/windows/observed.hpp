// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/study/windows/observation.hpp"

namespace backwash::study {

/// What was looked at, as bytes, and back again to the last bit. For the same program on machines of one byte order.
std::string packed(Observed flights);
/// Nothing where the bytes are none of packed(), or not all of them.
std::optional<Observed> unpacked(std::string_view bytes);

}  // namespace backwash::study
