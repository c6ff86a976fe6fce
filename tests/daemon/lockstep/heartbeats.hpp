// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "firmware_bridge/mavlink/messages.hpp"

namespace backwash::daemon::test {

/// What a PX4 copter says of itself; custom_mode: one of these, or another of its modes.
inline mavlink::Heartbeat heartbeat(bool armed, std::uint32_t custom_mode) {
  return {.custom_mode = custom_mode,
          .type = 2,
          .autopilot = 12,
          .base_mode = static_cast<std::uint8_t>(1 | (armed ? 128 : 0)),
          .system_status = 4,
          .mavlink_version = 3};
}
inline constexpr std::uint32_t kOffboard = 6u << 16, kReturn = 4u << 16 | 5u << 24;

}  // namespace backwash::daemon::test
