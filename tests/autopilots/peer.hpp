// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>

#include "firmware_bridge/mavlink/messages.hpp"
#include "services/backwashd/link_watch.hpp"

namespace backwash::autopilots {

/// One end of a MAVLink line for tests: every message that comes, any message that we like to send. It waits for
/// nothing and has no opinion about what it says.
class Peer {
 public:
  /// `device` as in the daemon's [link]. Throws std::runtime_error when it cannot be opened.
  Peer(const std::string& device, std::uint8_t system, std::uint8_t component)
      : port_(opened(device)), system_(system), component_(component) {}

  /// Calls visit(sender, message) for each message that has arrived. Throws when the line is lost.
  template <class Visit>
  void poll(Visit&& visit) {
    std::array<std::uint8_t, 2048> bytes;
    for (;;) {
      const auto n = std::visit([&](auto& port) { return port.read(bytes); }, port_);
      if (!n) throw std::runtime_error("line lost: " + describe(n.error()));
      if (*n == 0) return;
      parser_.feed(std::span(bytes).first(*n), [&](const mavlink::Frame& frame) {
        mavlink::decode_and_visit(frame.id, frame.payload, [&](const auto& m) { visit(frame.sender, m); });
      });
    }
  }

  template <class Message>
  void send(const Message& message) {
    const auto frame = mavlink::encode_frame({system_, component_, sequence_++}, message);
    std::visit([&](auto& port) { (void)port.write(frame.view()); }, port_);
  }

  const mavlink::ParserCounters& counters() const { return parser_.counters(); }

 private:
  static firmware_bridge::Port opened(const std::string& device) {
    const auto endpoint = config::link_device(device);
    if (!endpoint) throw std::runtime_error(device + ": no device");
    auto port = daemon::open_port({.device = device, .endpoint = *endpoint, .baud = 921600, .system = 1});
    if (!port) throw std::runtime_error(device + " " + describe(port.error()));
    return std::move(*port);
  }

  firmware_bridge::Port port_;
  mavlink::Parser parser_;
  std::uint8_t system_, component_, sequence_ = 0;
};

}  // namespace backwash::autopilots
