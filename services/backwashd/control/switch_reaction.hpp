// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/track/supervisor.hpp"
#include "services/backwashd/out/switched.hpp"

namespace backwash::daemon {

/// Whether this switch lets the vehicle be flown.
constexpr bool may_fly(firmware_bridge::SwitchState state) noexcept {
  return state == firmware_bridge::SwitchState::absent || state == firmware_bridge::SwitchState::released;
}

/// Why a command that moves the vehicle is refused beside this switch; empty: it is not. Not real-time.
std::string refusal(firmware_bridge::SwitchState state);

/// What the stop switch makes of the operators' request in each tick (docs/faults.md row 37): it is one more operator,
/// who says STOP for as long as it may not be flown on. A switch that is broken, not pressed, ends the flight: LAND
/// once it has been so for kLandAfter. It is heard where something of ours moves the vehicle and nowhere else: a pilot
/// is never fought.
class SwitchReaction {
 public:
  static constexpr std::int64_t kLandAfter_ns = 3'000'000'000;  ///< longer than the longest stop takes to come to rest
  static constexpr std::int64_t kSilent_ns = 300'000'000;       ///< without a reading: lost

  /// Reading as of now. Real-time: wait-free.
  static firmware_bridge::SwitchState read(const SwitchReading& reading, std::int64_t now_ns) noexcept;
  /// Real-time: wait-free, no allocation.
  track::Request request(firmware_bridge::SwitchState state, Mode mode, track::Request asked,
                         std::int64_t now_ns) noexcept;

 private:
  std::optional<std::int64_t> broken_ns_;  // since then, while something of ours moves the vehicle
};

}  // namespace backwash::daemon
