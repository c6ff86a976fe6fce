// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string_view>

namespace backwash::firmware_bridge {

/// A parameter's name in some versions of a firmware, and how much of its unit there is one of ours (m/s, m/s², s,
/// degrees; gains have ours).
struct ParameterName {
  std::string_view name;  ///< a literal of at most 16 characters
  double scale = 1;
};

/// What a rule asks of its parameter.
enum class Ask : std::uint8_t {
  time_out,  ///< s, above 0; control is not taken beyond `bound`; unwise where it and `late` are beyond kLastMotion
  one_of,    ///< an integer n with bit n of `bound`
  bits,      ///< an integer with all bits of `bound`
  at_least,  ///< `bound` or more
  at_most,   ///< `bound` or less
  k_d_horizontal,  ///< velocity gain, as the vehicle file's
  k_p_horizontal,  ///< position gain: k_p over the velocity gain
  k_d_vertical,
  k_p_vertical,
  k_i_horizontal,  ///< of the velocity; read from parameter files alone
  k_i_vertical,
  v_max,         ///< as much as the vehicle file's or more
  a_max,         ///< the same
  lean,          ///< that of a_max along both horizontal axes; firmwares bound g·tan(lean), whatever is asked upwards
  lean_or_zero,  ///< the same; 0: another parameter's
  delay,  ///< of ODOMETRY, s: what the line adds, and up to kLatestVio of the VIO's own; required where there is one
};

/// How much rests on it.
enum class Need : std::uint8_t {
  required,   ///< control is not taken unless it is good
  told,       ///< advice alone
  if_it_has,  ///< advice alone, and only to a firmware that has the parameter
  file,       ///< never asked for: for whoever reads a parameter file
};

/// One parameter of an autopilot on which a promise of ours rests.
struct ParameterRule {
  ParameterName names[2];  ///< the older versions' first; the second is empty where it was never renamed
  Need need = Need::told;
  Ask ask = Ask::one_of;
  double bound = 0;
  std::string_view why = {};  ///< behind "set NAME ": of one_of, bits, at_least and at_most
  double late = 0;            ///< s: how much later than a time_out says the autopilot may act

  constexpr std::size_t count() const noexcept { return names[1].name.empty() ? 1 : 2; }
};
constexpr int any_of(std::initializer_list<int> allowed) noexcept {
  int mask = 0;
  for (const int n : allowed) mask |= 1 << n;
  return mask;
}

/// A message that an autopilot is to send, and how often (SET_MESSAGE_INTERVAL).
struct Stream {
  std::uint32_t id;
  double rate_hz;
};

inline constexpr Stream kPositionStream{32, 50}, kAttitudeStream{31, 50};  // LOCAL_POSITION_NED, ATTITUDE_QUATERNION
/// HEARTBEAT tells arming and mode: at its usual 1 Hz, PX4's tells a pilot's mode up to a second late. Of ODOMETRY its
/// reset counter counts, of SYS_STATUS (1) whether it would arm.
inline constexpr Stream kUsualStreams[] = {kPositionStream, kAttitudeStream, {0, 10}, {245, 5},
                                           {331, 5},        {147, 1},        {1, 2}};

/// All that distinguishes one autopilot from another on the line. One file each in this directory, and a line in
/// profiles.cpp. Sources: docs/autopilots.md.
struct AutopilotProfile {
  std::string_view name = "unknown";  ///< as in the daemon's status
  std::uint8_t number = 0;            ///< MAV_AUTOPILOT of its heartbeats
  /// What it may be asked, those without which control is not taken first; a velocity gain before its position gain.
  std::span<const ParameterRule> rules = {};
  std::span<const Stream> streams = kUsualStreams;
  bool follows = false;             ///< it has a mode in which it follows set-points: `follow`
  std::uint32_t follow = 0;         ///< number of that mode, as MAV_CMD_DO_SET_MODE has it …
  int follow_shift = 0;             ///< … and a heartbeat's custom_mode behind so many bits
  std::uint32_t follow_mask = ~0U;  ///< … which are these
  bool lifts_itself = false;        ///< takes off by a command of its own, ignores set-points on the ground
  bool needs_origin = false;        ///< arms only where its local frame lies on the globe
  bool integers_bytewise = false;   ///< PARAM_VALUE has an integer's bytes where the float is
  /// Tells what its estimator uses: ESTIMATOR_STATUS or EKF_STATUS_REPORT; rate 0: none does.
  Stream estimator = {0, 0};

  /// Whether `custom_mode` of its heartbeat is `follow`.
  constexpr bool follows_in(std::uint32_t custom_mode) const noexcept {
    return follows && (custom_mode >> follow_shift & follow_mask) == follow;
  }
};
inline constexpr std::size_t kMostParameters = 40;

/// From our last set-point to when the autopilot no longer follows it, s, at most (docs/faults.md row 36).
inline constexpr double kLastMotion = 0.5;
/// How old odometry may be at most when it reaches us, s (docs/faults.md row 1): more is no delay of a VIO's.
inline constexpr double kLatestVio = 0.08;
/// %, of an ODOMETRY whose position is worth as little as kHalfQuality (outgoing.hpp).
inline constexpr double kLeastQuality = 50;

extern const AutopilotProfile kPx4, kArduPilot, kPlain, kUnknownAutopilot;

/// Every autopilot that is known.
std::span<const AutopilotProfile* const> autopilots() noexcept;
/// The one of `among` with this number of MAV_AUTOPILOT; kUnknownAutopilot where there is none. Real-time.
const AutopilotProfile& profile_of(std::uint8_t number,
                                   std::span<const AutopilotProfile* const> among = autopilots()) noexcept;

}  // namespace backwash::firmware_bridge
