// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/sim/hover_flight.hpp"

namespace backwash::services {

/// Reads what `simulate` flies (README.md, "Flight specification"); throws Failure 66 if there is none, 78 with
/// FILE:LINE for an unknown, missing or wrong key. `seed` takes the place of the file's: the jitter of a grid is drawn
/// from it too.
sim::HoverFlight read_flight_spec(const std::string& path, std::optional<std::uint64_t> seed);

}  // namespace backwash::services
