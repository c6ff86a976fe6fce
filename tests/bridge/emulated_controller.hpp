// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <limits>

#include "firmware_bridge/autopilot_link.hpp"
#include "tests/bridge/pseudo_terminal.hpp"

namespace backwash::firmware_bridge::test {

using namespace std::chrono_literals;

inline constexpr std::uint8_t kVehicle = 42;  // system id
inline const Time kStart = Time{} + 1000s;
inline constexpr auto kTick = 20ms;
inline constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

inline mavlink::Heartbeat px4_heartbeat(bool armed, std::uint32_t main_mode) {
  return {.custom_mode = main_mode << 16,
          .type = 2,
          .autopilot = 12,
          .base_mode = static_cast<std::uint8_t>(armed ? 0x81 : 0x01),
          .system_status = 4,
          .mavlink_version = 3};
}

/// A flight controller's end of a pseudo-terminal, and the link at the other end.
class LinkTest : public testing::Test {
 protected:
  template <class Message>
  void say(const Message& message, std::uint8_t system = kVehicle, std::uint8_t component = 1) {
    far_.write(mavlink::encode_frame({system, component, sequence_++}, message).view());
  }
  /// Polls until the parser has seen `frames` in all; a pseudo-terminal hands bytes over in its own time.
  void poll_until(std::uint64_t frames, Time now = kStart) {
    for (int i = 0; i < 1000 && link_.received().frames < frames; ++i) {
      ASSERT_TRUE(link_.poll(now));
      if (link_.received().frames < frames) ::usleep(1000);
    }
    ASSERT_EQ(link_.received().frames, frames);
  }
  template <class Message>
  void say_and_poll(const Message& message, Time now = kStart, std::uint8_t system = kVehicle,
                    std::uint8_t component = 1) {
    const auto before = link_.received().frames;
    say(message, system, component);
    poll_until(before + 1, now);
  }
  void introduce_vehicle(Time now = kStart) { say_and_poll(px4_heartbeat(false, 1), now); }
  /// The frames that the link has sent.
  std::vector<mavlink::test::Received> heard() { return mavlink::test::parse(far_.await()); }
  template <class Message>
  Message heard_one() {
    const auto frames = heard();
    EXPECT_EQ(frames.size(), 1U);
    if (frames.size() != 1) return {};
    EXPECT_EQ(frames[0].frame.id, Message::kId);
    EXPECT_EQ(frames[0].frame.sender.system, kVehicle);
    EXPECT_EQ(frames[0].frame.sender.component, 191);
    return mavlink::decode<Message>(frames[0].payload);
  }
  static Port open(const std::string& path) {
    auto port = SerialPort::open(path, 921600);
    if (!port) throw std::runtime_error(describe(port.error()));
    return std::move(*port);
  }

  PseudoTerminal far_;
  AutopilotLink link_{open(far_.path()), std::nullopt, kStart};
  std::uint8_t sequence_ = 0;
};

}  // namespace backwash::firmware_bridge::test
