// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>

#include "services/backwashd/control/controlled.hpp"
#include "services/backwashd/in/received.hpp"
#include "services/backwashd/map/mapped.hpp"
#include "services/backwashd/out/switched.hpp"
#include "services/backwashd/plan/planned.hpp"

namespace backwash::daemon {

/// What the daemon's threads hand to each other, by who writes it. But for the counts every member has exactly one
/// writing and one reading thread and is wait-free; the picture is in services/backwashd/README.md.
struct Channels : Received, Mapped, Planned, Controlled {
  SwitchReading stop_switch;  // gpio → control
  std::atomic<bool> stop{false};

  /// Records of real-time threads that the raw log had no room for.
  std::uint64_t records_lost() const noexcept { return control_log.lost() + command_log.lost(); }
};

}  // namespace backwash::daemon
