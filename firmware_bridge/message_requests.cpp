// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/message_requests.hpp"

namespace backwash::firmware_bridge {
namespace {

/// MAV_RESULT: denied, unsupported, failed; not those that only put off.
bool final_refusal(std::uint8_t result) noexcept { return result >= 2 && result <= 4; }

}  // namespace

std::optional<MessageRequests::Wish> MessageRequests::next(const Latest<CommandResult>& answer, Time now) noexcept {
  if (asked_) {
    const bool answered = answer && answer->at >= *asked_;
    if (!answered && now - *asked_ < kAnswer) return std::nullopt;
    if (answered && final_refusal(answer->value.result)) denied_.set(at_);
    asked_.reset();
    ++at_;
  }
  const auto open = [this] {
    while (at_ < kWishes.size() && denied_.test(at_)) ++at_;
    return at_ < kWishes.size();
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
  return kWishes[at_];
}

}  // namespace backwash::firmware_bridge
