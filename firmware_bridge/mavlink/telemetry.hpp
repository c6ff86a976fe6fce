// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "firmware_bridge/mavlink/codec.hpp"

// Messages of common.xml: what a flight controller tells. Values are raw, as on the wire (NED, FRD, the units named
// here); fields() lists the members in wire order, extensions last: it is all that the codec knows of a message.

namespace backwash::mavlink {

/// HEARTBEAT: Presence, type and mode of a component; 1 Hz.
struct Heartbeat {
  static constexpr std::uint32_t kId = 0;
  static constexpr std::string_view kName = "HEARTBEAT";
  std::uint32_t custom_mode = 0;
  std::uint8_t type = 0, autopilot = 0, base_mode = 0, system_status = 0, mavlink_version = 0;
  static constexpr auto fields() noexcept {
    using M = Heartbeat;
    return std::tuple{field("custom_mode", &M::custom_mode),     field("type", &M::type),
                      field("autopilot", &M::autopilot),         field("base_mode", &M::base_mode),
                      field("system_status", &M::system_status), field("mavlink_version", &M::mavlink_version)};
  }
};

/// SYSTEM_TIME: Wall clock (µs since 1970) and time since boot of the sender.
struct SystemTime {
  static constexpr std::uint32_t kId = 2;
  static constexpr std::string_view kName = "SYSTEM_TIME";
  std::uint64_t time_unix_usec = 0;
  std::uint32_t time_boot_ms = 0;
  static constexpr auto fields() noexcept {
    using M = SystemTime;
    return std::tuple{field("time_unix_usec", &M::time_unix_usec), field("time_boot_ms", &M::time_boot_ms)};
  }
};

/// LOCAL_POSITION_NED: The controller's own position and velocity estimate: NED, m, m/s.
struct LocalPositionNed {
  static constexpr std::uint32_t kId = 32;
  static constexpr std::string_view kName = "LOCAL_POSITION_NED";
  std::uint32_t time_boot_ms = 0;
  float x = 0, y = 0, z = 0, vx = 0, vy = 0, vz = 0;
  static constexpr auto fields() noexcept {
    using M = LocalPositionNed;
    return std::tuple{field("time_boot_ms", &M::time_boot_ms),
                      field("x", &M::x),
                      field("y", &M::y),
                      field("z", &M::z),
                      field("vx", &M::vx),
                      field("vy", &M::vy),
                      field("vz", &M::vz)};
  }
};

/// POSITION_TARGET_LOCAL_NED: Set-point that the controller follows now; fields as in SetPositionTargetLocalNed.
struct PositionTargetLocalNed {
  static constexpr std::uint32_t kId = 85;
  static constexpr std::string_view kName = "POSITION_TARGET_LOCAL_NED";
  std::uint32_t time_boot_ms = 0;
  float x = 0, y = 0, z = 0, vx = 0, vy = 0, vz = 0, afx = 0, afy = 0, afz = 0, yaw = 0, yaw_rate = 0;
  std::uint16_t type_mask = 0;
  std::uint8_t coordinate_frame = 0;
  static constexpr auto fields() noexcept {
    using M = PositionTargetLocalNed;
    return std::tuple{field("time_boot_ms", &M::time_boot_ms),
                      field("x", &M::x),
                      field("y", &M::y),
                      field("z", &M::z),
                      field("vx", &M::vx),
                      field("vy", &M::vy),
                      field("vz", &M::vz),
                      field("afx", &M::afx),
                      field("afy", &M::afy),
                      field("afz", &M::afz),
                      field("yaw", &M::yaw),
                      field("yaw_rate", &M::yaw_rate),
                      field("type_mask", &M::type_mask),
                      field("coordinate_frame", &M::coordinate_frame)};
  }
};

/// ATTITUDE: Body FRD to NED as roll, pitch, yaw (rad); body rates about FRD, rad/s.
struct Attitude {
  static constexpr std::uint32_t kId = 30;
  static constexpr std::string_view kName = "ATTITUDE";
  std::uint32_t time_boot_ms = 0;
  float roll = 0, pitch = 0, yaw = 0, rollspeed = 0, pitchspeed = 0, yawspeed = 0;
  static constexpr auto fields() noexcept {
    using M = Attitude;
    return std::tuple{field("time_boot_ms", &M::time_boot_ms),
                      field("roll", &M::roll),
                      field("pitch", &M::pitch),
                      field("yaw", &M::yaw),
                      field("rollspeed", &M::rollspeed),
                      field("pitchspeed", &M::pitchspeed),
                      field("yawspeed", &M::yawspeed)};
  }
};

/// ATTITUDE_QUATERNION: Body FRD to NED as unit quaternion (q1 = w); body rates about FRD, rad/s.
struct AttitudeQuaternion {
  static constexpr std::uint32_t kId = 31;
  static constexpr std::string_view kName = "ATTITUDE_QUATERNION";
  std::uint32_t time_boot_ms = 0;
  float q1 = 0, q2 = 0, q3 = 0, q4 = 0, rollspeed = 0, pitchspeed = 0, yawspeed = 0;
  std::array<float, 4> repr_offset_q{};
  static constexpr auto fields() noexcept {
    using M = AttitudeQuaternion;
    return std::tuple{field("time_boot_ms", &M::time_boot_ms),
                      field("q1", &M::q1),
                      field("q2", &M::q2),
                      field("q3", &M::q3),
                      field("q4", &M::q4),
                      field("rollspeed", &M::rollspeed),
                      field("pitchspeed", &M::pitchspeed),
                      field("yawspeed", &M::yawspeed),
                      extension("repr_offset_q", &M::repr_offset_q)};
  }
};

/// SYS_STATUS: Sensor health bits, load in 0.1 %, battery in mV, 10 mA (−1: unknown) and % (−1: unknown).
struct SysStatus {
  static constexpr std::uint32_t kId = 1;
  static constexpr std::string_view kName = "SYS_STATUS";
  std::uint32_t onboard_control_sensors_present = 0, onboard_control_sensors_enabled = 0,
                onboard_control_sensors_health = 0;
  std::uint16_t load = 0, voltage_battery = 0;
  std::int16_t current_battery = 0;
  std::uint16_t drop_rate_comm = 0, errors_comm = 0, errors_count1 = 0, errors_count2 = 0, errors_count3 = 0,
                errors_count4 = 0;
  std::int8_t battery_remaining = 0;
  std::uint32_t onboard_control_sensors_present_extended = 0, onboard_control_sensors_enabled_extended = 0,
                onboard_control_sensors_health_extended = 0;
  static constexpr auto fields() noexcept {
    using M = SysStatus;
    return std::tuple{
        field("onboard_control_sensors_present", &M::onboard_control_sensors_present),
        field("onboard_control_sensors_enabled", &M::onboard_control_sensors_enabled),
        field("onboard_control_sensors_health", &M::onboard_control_sensors_health),
        field("load", &M::load),
        field("voltage_battery", &M::voltage_battery),
        field("current_battery", &M::current_battery),
        field("drop_rate_comm", &M::drop_rate_comm),
        field("errors_comm", &M::errors_comm),
        field("errors_count1", &M::errors_count1),
        field("errors_count2", &M::errors_count2),
        field("errors_count3", &M::errors_count3),
        field("errors_count4", &M::errors_count4),
        field("battery_remaining", &M::battery_remaining),
        extension("onboard_control_sensors_present_extended", &M::onboard_control_sensors_present_extended),
        extension("onboard_control_sensors_enabled_extended", &M::onboard_control_sensors_enabled_extended),
        extension("onboard_control_sensors_health_extended", &M::onboard_control_sensors_health_extended)};
  }
};

/// BATTERY_STATUS: Cells in mV (65535: absent), current in 10 mA (−1: unknown), consumed mAh and hJ, temperature in
/// 0.01 °C, remaining in % (−1: unknown).
struct BatteryStatus {
  static constexpr std::uint32_t kId = 147;
  static constexpr std::string_view kName = "BATTERY_STATUS";
  std::int32_t current_consumed = 0, energy_consumed = 0;
  std::int16_t temperature = 0;
  std::array<std::uint16_t, 10> voltages{};
  std::int16_t current_battery = 0;
  std::uint8_t id = 0, battery_function = 0, type = 0;
  std::int8_t battery_remaining = 0;
  std::int32_t time_remaining = 0;
  std::uint8_t charge_state = 0;
  std::array<std::uint16_t, 4> voltages_ext{};
  std::uint8_t mode = 0;
  std::uint32_t fault_bitmask = 0;
  static constexpr auto fields() noexcept {
    using M = BatteryStatus;
    return std::tuple{field("current_consumed", &M::current_consumed),
                      field("energy_consumed", &M::energy_consumed),
                      field("temperature", &M::temperature),
                      field("voltages", &M::voltages),
                      field("current_battery", &M::current_battery),
                      field("id", &M::id),
                      field("battery_function", &M::battery_function),
                      field("type", &M::type),
                      field("battery_remaining", &M::battery_remaining),
                      extension("time_remaining", &M::time_remaining),
                      extension("charge_state", &M::charge_state),
                      extension("voltages_ext", &M::voltages_ext),
                      extension("mode", &M::mode),
                      extension("fault_bitmask", &M::fault_bitmask)};
  }
};

/// EXTENDED_SYS_STATE: landed_state: 0 undefined, 1 on ground, 2 in air, 3 take-off, 4 landing.
struct ExtendedSysState {
  static constexpr std::uint32_t kId = 245;
  static constexpr std::string_view kName = "EXTENDED_SYS_STATE";
  std::uint8_t vtol_state = 0, landed_state = 0;
  static constexpr auto fields() noexcept {
    using M = ExtendedSysState;
    return std::tuple{field("vtol_state", &M::vtol_state), field("landed_state", &M::landed_state)};
  }
};

/// COMMAND_ACK: Answer to a command: result 0 accepted, 1 temporarily rejected, 2 denied, 3 unsupported, 4 failed, 5 in
/// progress.
struct CommandAck {
  static constexpr std::uint32_t kId = 77;
  static constexpr std::string_view kName = "COMMAND_ACK";
  std::uint16_t command = 0;
  std::uint8_t result = 0, progress = 0;
  std::int32_t result_param2 = 0;
  std::uint8_t target_system = 0, target_component = 0;
  static constexpr auto fields() noexcept {
    using M = CommandAck;
    return std::tuple{field("command", &M::command),
                      field("result", &M::result),
                      extension("progress", &M::progress),
                      extension("result_param2", &M::result_param2),
                      extension("target_system", &M::target_system),
                      extension("target_component", &M::target_component)};
  }
};

/// STATUSTEXT: Text for the operator, zero-terminated when shorter than 50; severity as syslog (0 emergency … 7 debug).
struct Statustext {
  static constexpr std::uint32_t kId = 253;
  static constexpr std::string_view kName = "STATUSTEXT";
  std::uint8_t severity = 0;
  std::array<char, 50> text{};
  std::uint16_t id = 0;
  std::uint8_t chunk_seq = 0;
  static constexpr auto fields() noexcept {
    using M = Statustext;
    return std::tuple{field("severity", &M::severity), field("text", &M::text), extension("id", &M::id),
                      extension("chunk_seq", &M::chunk_seq)};
  }
};

/// PARAM_VALUE: A parameter. PX4 carries integers bytewise in param_value; the name has no terminator when 16
/// characters long.
struct ParamValue {
  static constexpr std::uint32_t kId = 22;
  static constexpr std::string_view kName = "PARAM_VALUE";
  float param_value = 0;
  std::uint16_t param_count = 0, param_index = 0;
  std::array<char, 16> param_id{};
  std::uint8_t param_type = 0;
  static constexpr auto fields() noexcept {
    using M = ParamValue;
    return std::tuple{field("param_value", &M::param_value), field("param_count", &M::param_count),
                      field("param_index", &M::param_index), field("param_id", &M::param_id),
                      field("param_type", &M::param_type)};
  }
};

}  // namespace backwash::mavlink
