// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "core/config/daemon_config.hpp"
#include "firmware_bridge/gpio/line.hpp"
#include "services/backwashd/control/controlled.hpp"

namespace backwash::daemon {

struct Channels;

/// The lines of the [gpio] table. Their driver may wait (an I²C expander for its bus, for milliseconds), so that the
/// control thread never touches them: it leaves its tick count in an atomic and reads the switch's state from one. The
/// strobe moves only if the count has risen, so it stops with the ticks, and if this thread hangs it stops as well.
class GpioWorker {
 public:
  using Time = std::chrono::steady_clock::time_point;
  /// From here on a named stop switch counts as lost until it is read.
  GpioWorker(Channels& channels, const config::Daemon::Gpio& names);
  /// Waits a few milliseconds for an edge, then takes the switch and sets the outputs. What cannot be had, or is lost,
  /// is told once for each reason and tried again each second.
  void step();

 private:
  struct Wanted {
    const char* what;  // for people
    std::string name;
    firmware_bridge::GpioLine::Use use;
    std::optional<firmware_bridge::GpioLine> line{};
    std::string told{};  // the error that was told last
  };
  void open_missing(Time now);
  void lose(Wanted& wanted, const std::string& why);
  void take_switch();
  void tell_switch();
  void drive(Wanted& wanted, bool high);

  Channels& channels_;
  std::string chip_;
  Wanted stop_switch_, strobe_, led_;
  firmware_bridge::StopSwitch switch_;
  firmware_bridge::SwitchState told_ = firmware_bridge::SwitchState::absent;
  firmware_bridge::Strobe edges_;
  std::uint64_t ticks_ = 0;
  Time ticked_{}, tried_{};
  Time pressed_{};  // when an edge last found the switch pressed
};

/// Thread body: step() until the daemon ends. `priority`: SCHED_FIFO, 0: none.
void run_gpio(Channels& channels, GpioWorker& worker, int priority);

}  // namespace backwash::daemon
