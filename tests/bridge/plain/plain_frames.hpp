// SPDX-License-Identifier: BSD-3-Clause
// Frames of the plain serial link as bytes.
#pragma once

#include "firmware_bridge/plain/plain.h"
#include "tests/bridge/emulated_controller.hpp"

namespace backwash::firmware_bridge::test {

inline std::vector<plain_event_t> events(plain_receiver_t& receiver, const Bytes& bytes) {
  std::vector<plain_event_t> all;
  for (const auto byte : bytes)
    if (const auto event = plain_receive(&receiver, byte); event != PLAIN_NOTHING) all.push_back(event);
  return all;
}

inline Bytes wire(const plain_command_t& c) {
  Bytes bytes(PLAIN_COMMAND_SIZE);
  plain_write_command(&c, bytes.data());
  return bytes;
}
inline Bytes wire(const plain_pose_t& p) {
  Bytes bytes(PLAIN_POSE_SIZE);
  plain_write_pose(&p, bytes.data());
  return bytes;
}
inline Bytes wire(const plain_state_t& s) {
  Bytes bytes(PLAIN_STATE_SIZE);
  plain_write_state(&s, bytes.data());
  return bytes;
}

inline plain_state_t flying() {
  plain_state_t s{};
  s.sequence = 1;
  s.armed = s.following = s.ground_known = s.pose_known = true;
  s.reset_counter = 3;
  s.time_ms = 5000;
  const float position[3] = {1, -2, 3}, velocity[3] = {0.5, 0.25, -0.125}, rates[3] = {0.1F, 0.2F, -0.3F};
  std::ranges::copy(position, s.position);
  std::ranges::copy(velocity, s.velocity);
  std::ranges::copy(rates, s.rates);
  s.attitude[0] = s.attitude[3] = std::sqrt(0.5F);  // a quarter turn to the left
  s.battery_percent = 87;
  s.battery_millivolts = 15600;
  return s;
}

}  // namespace backwash::firmware_bridge::test
