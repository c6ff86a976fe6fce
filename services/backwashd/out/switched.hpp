// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>

#include "firmware_bridge/gpio/stop_switch.hpp"

namespace backwash::daemon {

/// What the stop switch says, and when it was looked at last: a thread that hangs in its driver says nothing new.
struct SwitchReading {
  std::atomic<firmware_bridge::SwitchState> state{firmware_bridge::SwitchState::absent};
  std::atomic<std::int64_t> at_ns{0};
};

}  // namespace backwash::daemon
