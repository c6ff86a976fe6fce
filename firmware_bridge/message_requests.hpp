// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <bitset>

#include "firmware_bridge/telemetry.hpp"

namespace backwash::firmware_bridge {

/// What an autopilot is to send and how often (SET_MESSAGE_INTERVAL). One message is asked for at a time, because an
/// answer names the command and not the message. A message that is denied is not asked for again, the others every 2 s:
/// an autopilot may restart. Real-time: no allocation.
class MessageRequests {
 public:
  struct Wish {
    std::uint32_t id;
    double rate_hz;
  };
  /// HEARTBEAT tells arming and mode: at its usual 1 Hz, PX4's tells a pilot's mode up to a second late.
  static constexpr std::array<Wish, 6> kWishes{{{mavlink::LocalPositionNed::kId, 50},
                                                {mavlink::AttitudeQuaternion::kId, 50},
                                                {mavlink::Heartbeat::kId, 10},
                                                {mavlink::ExtendedSysState::kId, 5},
                                                {mavlink::Odometry::kId, 5},  // for its reset counter
                                                {mavlink::BatteryStatus::kId, 1}}};
  static constexpr auto kRound = std::chrono::seconds(2);          ///< from one round of questions to the next
  static constexpr auto kAnswer = std::chrono::milliseconds(300);  ///< that one is waited for
  /// Between two questions of a later round: together they would hold up a slow line.
  static constexpr auto kApart = std::chrono::milliseconds(300);

  /// What is to be asked for now, if anything. `answer`: the newest to SET_MESSAGE_INTERVAL.
  std::optional<Wish> next(const Latest<CommandResult>& answer, Time now) noexcept;
  /// Another autopilot may be there now, or the same one anew: everything is asked for again.
  void forget() noexcept { *this = {}; }

 private:
  std::bitset<kWishes.size()> denied_;
  std::size_t at_ = 0;                 // the wish that was asked for last, or is next
  std::optional<Time> asked_, round_;  // waiting for its answer; begin of this round
  std::optional<Time> last_;           // question of a later round
};

}  // namespace backwash::firmware_bridge
