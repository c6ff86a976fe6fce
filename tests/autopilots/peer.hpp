// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "firmware_bridge/mavlink/frame.hpp"
#include "firmware_bridge/mavlink/messages.hpp"

namespace backwash::autopilots {

/// A byte stream in both directions; read returns how many bytes came, 0 when there are no more.
struct Line {
  std::function<std::size_t(std::span<std::uint8_t>)> read;
  std::function<void(std::span<const std::uint8_t>)> write;
};

/// One end of a MAVLink line for tests: every message that comes, any message that we like to send. It waits for
/// nothing and has no opinion about what it says.
class Peer {
 public:
  Peer(Line line, std::uint8_t system, std::uint8_t component)
      : line_(std::move(line)), system_(system), component_(component) {}

  /// Calls visit(sender, message) for each message that has arrived. Throws what the line throws when it is lost.
  template <class Visit>
  void poll(Visit&& visit) {
    std::array<std::uint8_t, 2048> bytes;
    while (const std::size_t n = line_.read(bytes))
      parser_.feed(std::span(bytes).first(n), [&](const mavlink::Frame& frame) {
        mavlink::decode_and_visit(frame.id, frame.payload, [&](const auto& m) { visit(frame.sender, m); });
      });
  }

  template <class Message>
  void send(const Message& message) {
    line_.write(mavlink::encode_frame({system_, component_, sequence_++}, message).view());
  }

  const mavlink::ParserCounters& counters() const { return parser_.counters(); }

 private:
  Line line_;
  mavlink::Parser parser_;
  std::uint8_t system_, component_, sequence_ = 0;
};

}  // namespace backwash::autopilots
