// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/config/daemon_config.hpp"
#include "services/backwashd/control/controlled.hpp"
#include "services/backwashd/service_manager.hpp"

namespace backwash::daemon {

struct Channels;

/// Opens what [link] device names. Not real-time: a TCP connection is waited for half a second.
tl::expected<firmware_bridge::Port, firmware_bridge::PortError> open_port(const decltype(config::Daemon::link)& link);

/// What the line of [link] carries; that of a socket for which no share is given, everything. Error, by the key to
/// change: less than a flight needs (firmware_bridge::least_rate).
tl::expected<firmware_bridge::LineRate, std::string> configured_line(const decltype(config::Daemon::link)& link,
                                                                     const OdometryTiming& timing = {});

/// What went over the line, and what did not, in one line for the operator: received since its port was opened last,
/// sent and left out since the daemon's start.
std::string traffic(const firmware_bridge::AutopilotLink& link);

/// What the operator is told of the control thread, and the work on its port that must not be done in a tick.
class LinkWatch {
 public:
  LinkWatch(Channels& channels, const decltype(config::Daemon::link)& link, const ServiceManager& manager)
      : channels_(channels), link_(link), manager_(manager) {}
  /// Logs what the control thread reported, each loss of the port and a link fault that is new, and opens a lost port
  /// again (docs/faults.md rows 17 and 19), one that was lost again between two calls too. To be called a few times a
  /// second.
  void step();

 private:
  Channels& channels_;
  decltype(config::Daemon::link) link_;
  const ServiceManager& manager_;  ///< told each transition
  std::optional<firmware_bridge::LinkFault> fault_;
  std::uint32_t losses_ = 0;       ///< that were told
  std::uint64_t events_lost_ = 0;  ///< the same
  std::uint32_t mended_ = 0;       ///< for which a fresh port was offered: a loss of that one is the next
};

/// Thread body: step() every 50 ms.
void run_link_watch(Channels& channels, const decltype(config::Daemon::link)& link, const ServiceManager& manager);

}  // namespace backwash::daemon
