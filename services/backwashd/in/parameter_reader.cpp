// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/in/parameter_reader.hpp"

#include <utility>

namespace backwash::daemon {

void ParameterReader::step(firmware_bridge::AutopilotLink& link, firmware_bridge::Time now, bool may_ask,
                           bool may_repeat, ControlView& view) noexcept {
  const auto& telemetry = link.telemetry();
  const auto status = telemetry.status.at(now);
  const auto* const autopilot = status ? status->value.autopilot : &firmware_bridge::kUnknownAutopilot;
  if (std::exchange(view.autopilot, autopilot) != autopilot) next_ = 0;
  view.version = telemetry.version;
  // All of them in each tick: what the link has forgotten must not be enabled on for a moment longer.
  view.parameters = status ? telemetry.parameters() : firmware_bridge::ParameterValues{};
  const auto rules = view.autopilot->rules;
  const auto wants = [&](std::size_t n) { return rules[n].need != firmware_bridge::Need::file; };
  const auto asking = [&](std::size_t n) { return wants(n) && view.parameters[n].asking(rules[n]); };
  bool any = false;
  for (std::size_t n = 0; n < rules.size(); ++n) any = any || asking(n);
  if (!may_ask || rules.empty() || view.ticks % (any ? kTicksPerSecond / 10 : kTicksPerSecond) != 0) return;
  const auto is_next = [&](std::size_t n) {
    return any ? asking(n) : wants(n) && (may_repeat || !view.parameters[n].value);
  };
  for (std::size_t passed = 0; passed < rules.size(); ++passed) {
    const std::size_t n = std::exchange(next_, (next_ + 1) % rules.size());
    if (!is_next(n)) continue;
    link.send_parameter_request(n);
    return;
  }
}

}  // namespace backwash::daemon
