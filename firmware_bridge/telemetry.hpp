// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <chrono>
#include <optional>
#include <string_view>

#include "core/types/state.hpp"
#include "firmware_bridge/autopilots/profile.hpp"
#include "firmware_bridge/mavlink/messages.hpp"
#include "firmware_bridge/parameters.hpp"

namespace backwash::firmware_bridge {

/// Monotonic time; the caller passes it in, so that tests can count it in ticks.
using Time = std::chrono::steady_clock::time_point;

/// A value and when it arrived here.
template <class T>
struct Received {
  T value;
  Time at;
};
template <class T>
using Latest = std::optional<Received<T>>;

/// What the controller says of itself, which counts for so many ms: nobody gets at an older one, and what is unknown
/// is for each reader to bear (docs/faults.md row 56).
template <class T, int kUseBy_ms>
class Fact {
 public:
  static constexpr std::chrono::milliseconds kUseBy{kUseBy_ms};
  void take(const T& value, Time at) noexcept { newest_ = {value, at}; }
  Latest<T> at(Time now) const noexcept { return newest_ && now - newest_->at <= kUseBy ? newest_ : std::nullopt; }
  /// However old; absent before the first.
  std::optional<Time::duration> age(Time now) const noexcept {
    return newest_ ? std::optional(now - newest_->at) : std::nullopt;
  }

 private:
  Latest<T> newest_;
};
/// ms. Of what an autopilot says once a second at least: as long as its heartbeat may be missing (row 21). Its pose:
/// until LAND (row 42). Its battery: two of PX4's own messages may be lost.
inline constexpr int kSecondly_ms = 1500, kPoseUseBy_ms = 1000, kBatteryUseBy_ms = 5000;
inline constexpr std::chrono::milliseconds kHeartbeatTimeout{kSecondly_ms};  ///< docs/faults.md row 21

/// From HEARTBEAT.
struct VehicleStatus {
  const AutopilotProfile* autopilot = &kUnknownAutopilot;  ///< never null
  bool armed = false;
  bool follows_setpoints = false;  ///< it is in the mode in which it follows them
  std::uint32_t custom_mode = 0;
  std::uint8_t system_status = 0;  ///< MAV_STATE: 3 standby, 4 active, 5 critical (a failsafe acts), 6 emergency
};

/// From ATTITUDE_QUATERNION or ATTITUDE.
struct VehicleAttitude {
  Eigen::Quaterniond q_LB;  ///< body FLU to the controller's local frame L, z-up
  Vec3 omega_B;             ///< rad/s, FLU
};

/// From BATTERY_STATUS of battery 0; from SYS_STATUS where the controller sends none.
struct Battery {
  std::optional<double> voltage;    ///< V
  std::optional<double> remaining;  ///< 0…1
  std::optional<double> current;    ///< A out of it, below 0 while it is charged
};

/// From EXTENDED_SYS_STATE.
enum class LandedState : std::uint8_t { undefined, on_ground, in_air, taking_off, landing };

/// From AUTOPILOT_VERSION.
struct FirmwareVersion {
  std::uint8_t major = 0, minor = 0, patch = 0;
};

/// From COMMAND_ACK.
struct CommandResult {
  std::uint16_t command = 0;  ///< MAV_CMD
  std::uint8_t result = 0;    ///< MAV_RESULT, 0 = accepted
};

/// From STATUSTEXT.
struct StatusLine {
  std::uint8_t severity = 0;    ///< 0 emergency … 7 debug
  std::array<char, 51> text{};  ///< zero-terminated
};

/// The newest of everything that the flight controller said, converted to z-up and FLU. What never came is absent; what
/// came broken (not finite, no unit quaternion, further than 10 km or faster than 100 m/s or 100 rad/s) or after its
/// successor is dropped and counted. What holds until the controller says otherwise, as answers and parameters, has no
/// use-by; none of it outlives a restart. Real-time: take() is wait-free, no allocation.
class Telemetry {
 public:
  /// `among`: the autopilots that it knows.
  explicit Telemetry(std::span<const AutopilotProfile* const> among = autopilots()) noexcept : among_(among) {}

  Fact<VehicleStatus, kSecondly_ms> status;
  Fact<State, kPoseUseBy_ms>
      local_state;  ///< in the controller's own local frame L, z-up (p_W, v_W stand for p_L, v_L)
  Fact<VehicleAttitude, kPoseUseBy_ms> attitude;
  /// Of the controller's estimator, from ODOMETRY; a change: L has moved.
  Fact<std::uint8_t, kSecondly_ms> reset_counter;
  Fact<double, kSecondly_ms> position_sigma;  ///< of local_state as the controller says, from ODOMETRY, m
  Fact<Battery, kBatteryUseBy_ms> battery;
  Fact<LandedState, kSecondly_ms> landed_state;
  /// Its estimator says of itself that it takes its position from a sensor.
  Fact<bool, kBatteryUseBy_ms> estimator_follows;
  Fact<bool, kBatteryUseBy_ms> would_arm;  ///< its own checks say so, from SYS_STATUS
  Latest<StatusLine> text;
  std::optional<FirmwareVersion> version;  ///< absent: it has not said; not known after a restart
  /// Its local frame lies somewhere on the globe, as ArduPilot asks for before arming; not known after a restart, as
  /// with parameter().
  bool has_origin = false;
  std::uint64_t broken = 0;        ///< messages with values that cannot be
  std::uint64_t out_of_order = 0;  ///< messages older than their predecessor

  /// Newest answer to this command, if any came since the start.
  Latest<CommandResult> result_of(std::uint16_t command) const noexcept;

  /// The autopilot that is heard, or was last.
  const AutopilotProfile& autopilot() const noexcept { return *autopilot_; }
  /// What it has said of its profile's parameters. Others, which stations ask for, are not kept; after a silence of
  /// kHeartbeatTimeout, or when its clock is more than a second back, it may have restarted with other values, and none
  /// is; nor is one whose newest value is no number.
  const ParameterValues& parameters() const noexcept { return parameters_; }
  /// The name by which the parameter of this rule of autopilot() is to be asked for now; counts the question.
  std::string_view ask(std::size_t rule) noexcept;

  void take(const mavlink::Heartbeat& m, Time now) noexcept;
  void take(const mavlink::LocalPositionNed& m, Time now) noexcept;
  void take(const mavlink::AttitudeQuaternion& m, Time now) noexcept;
  void take(const mavlink::Attitude& m, Time now) noexcept;
  void take(const mavlink::Odometry& m, Time now) noexcept;
  void take(const mavlink::BatteryStatus& m, Time now) noexcept;
  void take(const mavlink::SysStatus& m, Time now) noexcept;
  void take(const mavlink::ExtendedSysState& m, Time now) noexcept;
  void take(const mavlink::CommandAck& m, Time now) noexcept;
  void take(const mavlink::Statustext& m, Time now) noexcept;
  void take(const mavlink::GpsGlobalOrigin&, Time) noexcept { has_origin = true; }
  void take(const mavlink::ParamValue& m, Time now) noexcept;
  void take(const mavlink::ParamError& m, Time now) noexcept;
  void take(const mavlink::AutopilotVersion& m, Time now) noexcept;
  void take(const mavlink::EstimatorStatus& m, Time now) noexcept { take_estimator(m.flags, now); }
  void take(const mavlink::EkfStatusReport& m, Time now) noexcept { take_estimator(m.flags, now); }

 private:
  void restarted() noexcept;
  void take_attitude(const Eigen::Quaterniond& q_NF, const Vec3& omega_F, std::uint32_t time_boot_ms,
                     Time now) noexcept;
  void take_estimator(std::uint16_t flags, Time now) noexcept;
  template <class Each>
  void each_named(const std::array<char, 16>& id, Each&& each) noexcept;
  bool in_order(std::optional<std::uint32_t>& last_ms, std::uint32_t now_ms) noexcept;

  std::optional<std::uint32_t> position_ms_, attitude_ms_;  // sender's clock
  bool battery_status_seen_ = false;
  std::array<Latest<CommandResult>, 8> results_;
  std::size_t next_result_ = 0;
  std::span<const AutopilotProfile* const> among_;
  const AutopilotProfile* autopilot_ = &kUnknownAutopilot;
  ParameterValues parameters_{};
  std::uint8_t generation_ = 0;  // which of two names the newest answer was of
};

}  // namespace backwash::firmware_bridge
