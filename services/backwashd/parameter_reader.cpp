// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/parameter_reader.hpp"

namespace backwash::daemon {

void ParameterReader::step(firmware_bridge::AutopilotLink& link, firmware_bridge::Time now, bool may_ask,
                           bool may_repeat, ControlView& view) noexcept {
  constexpr std::size_t kRounds = 3;
  const auto& telemetry = link.telemetry();
  const auto status = telemetry.status.at(now);
  const auto kind = status ? status->value.autopilot : firmware_bridge::Autopilot::kUnknown;
  if (kind != view.autopilot) {
    view.autopilot = kind;
    view.parameters = {};
    next_ = asked_ = 0;
  }
  const auto names = firmware_bridge::parameter_names(kind);
  if (names.empty()) return;
  // All of them in each tick: what the link has forgotten must not be enabled on for a moment longer.
  for (std::size_t n = 0; n < names.size(); ++n) {
    const auto known = telemetry.parameter(names[n]);
    if (!known && view.parameters[n]) asked_ = 0;  // it restarted
    view.parameters[n] = known ? std::optional(known->value) : std::nullopt;
  }
  const std::size_t every = asked_ < kRounds * names.size() ? kTicksPerSecond / 10 : kTicksPerSecond;
  if (!may_ask || view.ticks % every != 0) return;
  for (std::size_t skipped = 0; view.parameters[next_] && skipped < names.size(); ++skipped)
    next_ = (next_ + 1) % names.size();
  if (!view.parameters[next_] || may_repeat) {
    link.send_parameter_request(names[next_]);
    ++asked_;
  }
  next_ = (next_ + 1) % names.size();
}

}  // namespace backwash::daemon
