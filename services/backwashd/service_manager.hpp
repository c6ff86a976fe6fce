// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "firmware_bridge/port/port.hpp"

namespace backwash::daemon {

/// What is said to the service manager that started the process (sd_notify(3)) and to its journal. Each call is one
/// non-blocking datagram; one that nobody takes is dropped. Without a service manager every call does nothing.
class ServiceManager {
 public:
  /// Nobody listens.
  ServiceManager() = default;
  /// As NOTIFY_SOCKET and JOURNAL_STREAM in the environment say: the journal only if `log_fd` leads to it.
  static ServiceManager of_environment(int log_fd);

  /// The pipeline runs.
  void ready() const noexcept { notify("READY=1"); }
  /// The process was asked to end, or ends by a failure.
  void stopping() const noexcept { notify("STOPPING=1"); }
  /// The control thread is alive: to be called by it alone (the unit's WatchdogSec). Real-time: wait-free, no
  /// allocation; one non-blocking system call.
  void alive() const noexcept { notify("WATCHDOG=1"); }
  /// The newest mode and its reason: the manager's status line, and a journal entry with the fields BACKWASH_MODE and
  /// BACKWASH_REASON. Neither text may hold a line break. False: the journal has not taken it.
  bool transition(std::string_view mode, std::string_view reason) const;
  /// Whether lines on the log's descriptor go to the journal, which keeps time and level itself.
  bool has_journal() const noexcept { return journal_.get() >= 0; }

 private:
  void notify(std::string_view message) const noexcept;

  firmware_bridge::FileDescriptor manager_, journal_;
};

}  // namespace backwash::daemon
