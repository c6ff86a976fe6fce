// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/control/switch_reaction.hpp"

namespace backwash::daemon {

using firmware_bridge::SwitchState;
using track::Request;

std::string refusal(SwitchState state) {
  switch (state) {
    case SwitchState::absent:
    case SwitchState::released:
      return "";
    case SwitchState::lost:
      return "stop switch: its line cannot be read";
    case SwitchState::untested:
      return "stop switch: not seen in both positions yet: press and release it";
    case SwitchState::pressed:
      return "stop switch: pressed";
    case SwitchState::chattering:
      return "stop switch: chatters";
  }
  return "stop switch: unknown";
}

SwitchState SwitchReaction::read(const SwitchReading& reading, std::int64_t now_ns) noexcept {
  const std::int64_t at_ns = reading.at_ns.load(std::memory_order_acquire);
  const SwitchState state = reading.state.load(std::memory_order_relaxed);
  return state != SwitchState::absent && now_ns - at_ns > kSilent_ns ? SwitchState::lost : state;
}

Request SwitchReaction::request(SwitchState state, Mode mode, Request asked, std::int64_t now_ns) noexcept {
  const bool moves = mode == Mode::enabling || mode == Mode::lifting || mode == Mode::tracking || mode == Mode::hold;
  if (may_fly(state) || state == SwitchState::pressed || !moves)
    broken_ns_.reset();
  else if (!broken_ns_)
    broken_ns_ = now_ns;
  if (may_fly(state)) return asked;
  if (!moves) return asked == Request::enable ? Request::none : asked;
  if (asked == Request::land) return asked;
  return broken_ns_ && now_ns - *broken_ns_ > kLandAfter_ns ? Request::land : Request::stop;
}

}  // namespace backwash::daemon
