// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/message_requests.hpp"

namespace backwash::firmware_bridge {
namespace {

/// MAV_RESULT: denied, unsupported, failed; not those that only put off.
bool final_refusal(std::uint8_t result) noexcept { return result >= 2 && result <= 4; }

}  // namespace

std::optional<Stream> MessageRequests::next(const AutopilotProfile& autopilot, const Latest<CommandResult>& answer,
                                            Time now) noexcept {
  const std::size_t wishes = autopilot.streams.size() + (autopilot.estimator.rate_hz > 0 ? 1 : 0);
  if (asked_) {
    const bool answered = answer && answer->at >= *asked_;
    if (!answered && now - *asked_ < kAnswer) return std::nullopt;
    if (answered && final_refusal(answer->value.result)) denied_.set(at_);
    asked_.reset();
    ++at_;
  }
  if (asked_late_ && now - *asked_late_ < kApart / 2) return std::nullopt;
  const auto open = [&] {
    while (at_ < wishes && denied_.test(at_)) ++at_;
    return at_ < wishes;
  };
  if (!open()) {
    if (now - *round_ < kRound) return std::nullopt;
    at_ = 0;
    round_ = last_ = now;
    if (!open()) return std::nullopt;
  } else if (last_ && now - *last_ < kApart) {
    return std::nullopt;
  }
  if (!round_) round_ = now;
  if (last_) last_ = now;
  asked_ = now;
  return at_ < autopilot.streams.size() ? autopilot.streams[at_] : autopilot.estimator;
}

std::optional<Stream> MessageRequests::late(const Telemetry& telemetry, Time now) noexcept {
  const auto is_late = [&](const auto& fact) {
    const auto age = fact.age(now);
    return age && *age > kLate;
  };
  if (asked_) return std::nullopt;  // one question at a time: an answer does not say to which
  const auto may = [&](std::optional<Time>& last) {
    if (last && now - *last < kApart) return false;
    last = asked_late_ = now;
    return true;
  };
  if (asked_late_ && now - *asked_late_ < kApart / 4) return std::nullopt;
  if (is_late(telemetry.local_state) && may(late_position_)) return kPositionStream;
  if (is_late(telemetry.attitude) && may(late_attitude_)) return kAttitudeStream;
  return std::nullopt;
}

}  // namespace backwash::firmware_bridge
