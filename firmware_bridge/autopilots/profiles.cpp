// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/autopilots/profile.hpp"

namespace backwash::firmware_bridge {

constinit const AutopilotProfile kUnknownAutopilot{};
/// A controller behind a PlainPort: its contract has no parameters, and its streams are not asked for.
constinit const AutopilotProfile kPlain{.name = "plain", .number = 250, .follows = true, .follow = 1};

std::span<const AutopilotProfile* const> autopilots() noexcept {
  static constexpr const AutopilotProfile* kAll[] = {&kPx4, &kArduPilot, &kPlain};
  return kAll;
}

const AutopilotProfile& profile_of(std::uint8_t number, std::span<const AutopilotProfile* const> among) noexcept {
  for (const AutopilotProfile* profile : among)
    if (profile->number == number) return *profile;
  return kUnknownAutopilot;
}

}  // namespace backwash::firmware_bridge
