// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/gpio/stop_switch.hpp"

namespace backwash::firmware_bridge {

using namespace std::chrono_literals;

std::string_view name(SwitchState state) noexcept {
  switch (state) {
    case SwitchState::absent:
      return "absent";
    case SwitchState::lost:
      return "lost";
    case SwitchState::untested:
      return "untested";
    case SwitchState::pressed:
      return "pressed";
    case SwitchState::chattering:
      return "chattering";
    case SwitchState::released:
      return "released";
  }
  return "unknown";
}

void StopSwitch::see(bool open, Time at) noexcept {
  const auto judge = [&] {
    if (!level_ || at - since_ < kDebounce) return;
    settled_ = true;
    position_ = level_;
    (*level_ ? was_open_ : was_closed_) = true;
  };
  if (level_ != open) {
    judge();  // of the level that ends: nobody may have looked while it was held
    if (!level_ || settled_) unsettled_ = at;
    settled_ = false;
    level_ = open;
    since_ = at;
  }
  judge();
  chatters_ = !settled_ && at - unsettled_ >= kChatter;
}

SwitchState StopSwitch::state() const noexcept {
  if (!level_) return SwitchState::lost;
  if (chatters_) return SwitchState::chattering;
  if (!was_open_ || !was_closed_) return SwitchState::untested;
  return *position_ ? SwitchState::pressed : SwitchState::released;
}

bool lit(Signal signal, std::chrono::steady_clock::time_point now) noexcept {
  const auto since = now.time_since_epoch();
  switch (signal) {
    case Signal::idle:
      return since % 1s < 50ms;
    case Signal::commanding:
      return true;
    case Signal::fault:
      return since % 200ms < 100ms;
  }
  return false;
}

}  // namespace backwash::firmware_bridge
