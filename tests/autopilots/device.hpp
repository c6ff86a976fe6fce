// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <stdexcept>
#include <string>

#include "services/backwashd/control/link_watch.hpp"
#include "tests/autopilots/peer.hpp"

namespace backwash::autopilots {

/// A line over a device as in the daemon's [link]. Throws std::runtime_error when it cannot be opened, and when it is
/// lost.
inline Line open_line(const std::string& device) {
  const auto endpoint = config::link_device(device);
  if (!endpoint) throw std::runtime_error(device + ": no device");
  decltype(config::Daemon::link) link;
  link.device = device;
  link.endpoint = *endpoint;
  link.baud = 921600;
  auto opened = daemon::open_port(link);
  if (!opened) throw std::runtime_error(device + " " + describe(opened.error()));
  const auto port = std::make_shared<firmware_bridge::Port>(std::move(*opened));
  return {[port](std::span<std::uint8_t> bytes) {
            const auto n = std::visit([&](auto& p) { return p.read(bytes); }, *port);
            if (!n) throw std::runtime_error("line lost: " + describe(n.error()));
            return *n;
          },
          [port](std::span<const std::uint8_t> bytes) { std::visit([&](auto& p) { (void)p.write(bytes); }, *port); }};
}

}  // namespace backwash::autopilots
