// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bitset>

#include "firmware_bridge/telemetry.hpp"

namespace backwash::firmware_bridge {

/// What an autopilot is to send and how often (SET_MESSAGE_INTERVAL). One message is asked for at a time, because an
/// answer names the command and not the message. A message that is denied is not asked for again, the others every 2 s:
/// an autopilot may restart, and another station on its line may have asked for less. A pose that is late for that is
/// asked for before its turn. Real-time: no allocation.
class MessageRequests {
 public:
  static constexpr auto kRound = std::chrono::seconds(2);          ///< from one round of questions to the next
  static constexpr auto kAnswer = std::chrono::milliseconds(300);  ///< that one is waited for
  /// Between two questions of a later round: together they would hold up a slow line.
  static constexpr auto kApart = std::chrono::milliseconds(200);

  static constexpr auto kLate = std::chrono::milliseconds(100);  ///< of a position or an attitude that comes at 50 Hz

  /// What is to be asked for now, if anything. `answer`: the newest to SET_MESSAGE_INTERVAL.
  std::optional<Stream> next(const AutopilotProfile& autopilot, const Latest<CommandResult>& answer, Time now) noexcept;
  /// The stream whose newest message is older than kLate, if it may be asked for now: at once, then every kApart
  /// each, a quarter of that apart from the other's.
  std::optional<Stream> late(const Telemetry& telemetry, Time now) noexcept;
  /// Another autopilot may be there now, or the same one anew: everything is asked for again.
  void forget() noexcept { *this = {}; }

 private:
  std::bitset<16> denied_;
  std::size_t at_ = 0;                 // the stream that was asked for last, or is next; the estimator's behind all
  std::optional<Time> asked_, round_;  // waiting for its answer; begin of this round
  std::optional<Time> last_;           // question of a later round
  std::optional<Time> late_position_, late_attitude_, asked_late_;  // questions before their turn
};

}  // namespace backwash::firmware_bridge
