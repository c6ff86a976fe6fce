// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "core/track/supervisor.hpp"
#include "firmware_bridge/telemetry.hpp"

namespace backwash::daemon {

/// A pilot who changes the mode while we enable, before the autopilot follows us, wants something else: we ask for no
/// mode any more, as if he had said `disable` (docs/faults.md row 22). Once it follows, the supervisor itself looks.
class PilotReaction {
 public:
  /// What is asked of the supervisor in this tick: `request`, or to end the enabling. Real-time.
  track::Request request(Mode mode, const firmware_bridge::Latest<firmware_bridge::VehicleStatus>& status,
                         track::Request request) noexcept {
    const auto now = status ? std::optional(status->value.custom_mode) : std::nullopt;
    if (mode != Mode::enabling || !found_ || (status && status->value.follows_setpoints)) found_ = now;
    return now && now != found_ ? track::Request::disable : request;
  }

 private:
  std::optional<std::uint32_t> found_;  ///< mode in which the autopilot was found, as it numbers them
};

}  // namespace backwash::daemon
