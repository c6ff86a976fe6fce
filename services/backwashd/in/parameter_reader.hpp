// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "firmware_bridge/autopilot_link.hpp"
#include "services/backwashd/control/controlled.hpp"

namespace backwash::daemon {

/// Reads from the autopilot the parameters on which our promises rest: each in turn ten times a second until it is
/// known or was asked for in vain, then one a second, for a station may have changed it.
class ParameterReader {
 public:
  /// Once a tick, after view.ticks: what the link knows into the view, and one question where `may_ask`. Without
  /// `may_repeat` only for what is not known. Real-time: wait-free, no allocation.
  void step(firmware_bridge::AutopilotLink& link, firmware_bridge::Time now, bool may_ask, bool may_repeat,
            ControlView& view) noexcept;

 private:
  std::size_t next_ = 0;  // rule
};

}  // namespace backwash::daemon
