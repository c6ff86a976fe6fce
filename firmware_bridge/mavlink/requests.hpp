// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "firmware_bridge/mavlink/codec.hpp"

// Messages of common.xml: what a companion computer or ground station sends. Values are raw, as on the wire (NED, FRD,
// the units named here); fields() lists the members in wire order, extensions last: it is all that the codec knows of a
// message.

namespace backwash::mavlink {

/// SET_POSITION_TARGET_LOCAL_NED: Set-point for the controller: NED, m, m/s, m/s², rad; type_mask bits name the fields
/// to ignore (TypeMask).
struct SetPositionTargetLocalNed {
  static constexpr std::uint32_t kId = 84;
  static constexpr std::string_view kName = "SET_POSITION_TARGET_LOCAL_NED";
  std::uint32_t time_boot_ms = 0;
  float x = 0, y = 0, z = 0, vx = 0, vy = 0, vz = 0, afx = 0, afy = 0, afz = 0, yaw = 0, yaw_rate = 0;
  std::uint16_t type_mask = 0;
  std::uint8_t target_system = 0, target_component = 0, coordinate_frame = 0;
  static constexpr auto fields() noexcept {
    using M = SetPositionTargetLocalNed;
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
                      field("target_system", &M::target_system),
                      field("target_component", &M::target_component),
                      field("coordinate_frame", &M::coordinate_frame)};
  }
};

/// MANUAL_CONTROL: a ground station's sticks, -1000 to 1000; z, the throttle, 0 to 1000.
struct ManualControl {
  static constexpr std::uint32_t kId = 69;
  static constexpr std::string_view kName = "MANUAL_CONTROL";
  std::int16_t x = 0, y = 0, z = 0, r = 0;
  std::uint16_t buttons = 0;
  std::uint8_t target = 0;
  static constexpr auto fields() noexcept {
    using M = ManualControl;
    return std::tuple{field("x", &M::x),
                      field("y", &M::y),
                      field("z", &M::z),
                      field("r", &M::r),
                      field("buttons", &M::buttons),
                      field("target", &M::target)};
  }
};

/// COMMAND_LONG: One command (MAV_CMD) with seven parameters.
struct CommandLong {
  static constexpr std::uint32_t kId = 76;
  static constexpr std::string_view kName = "COMMAND_LONG";
  float param1 = 0, param2 = 0, param3 = 0, param4 = 0, param5 = 0, param6 = 0, param7 = 0;
  std::uint16_t command = 0;
  std::uint8_t target_system = 0, target_component = 0, confirmation = 0;
  static constexpr auto fields() noexcept {
    using M = CommandLong;
    return std::tuple{field("param1", &M::param1),
                      field("param2", &M::param2),
                      field("param3", &M::param3),
                      field("param4", &M::param4),
                      field("param5", &M::param5),
                      field("param6", &M::param6),
                      field("param7", &M::param7),
                      field("command", &M::command),
                      field("target_system", &M::target_system),
                      field("target_component", &M::target_component),
                      field("confirmation", &M::confirmation)};
  }
};

/// SET_MODE: Older request for a mode (COMMAND_LONG with MAV_CMD_DO_SET_MODE takes its place).
struct SetMode {
  static constexpr std::uint32_t kId = 11;
  static constexpr std::string_view kName = "SET_MODE";
  std::uint32_t custom_mode = 0;
  std::uint8_t target_system = 0, base_mode = 0;
  static constexpr auto fields() noexcept {
    using M = SetMode;
    return std::tuple{field("custom_mode", &M::custom_mode), field("target_system", &M::target_system),
                      field("base_mode", &M::base_mode)};
  }
};

/// TIMESYNC: Clock exchange, ns: tc1 = 0 asks; the answer carries the answerer's time in tc1 and the asker's in ts1.
struct Timesync {
  static constexpr std::uint32_t kId = 111;
  static constexpr std::string_view kName = "TIMESYNC";
  std::int64_t tc1 = 0, ts1 = 0;
  std::uint8_t target_system = 0, target_component = 0;
  static constexpr auto fields() noexcept {
    using M = Timesync;
    return std::tuple{field("tc1", &M::tc1), field("ts1", &M::ts1), extension("target_system", &M::target_system),
                      extension("target_component", &M::target_component)};
  }
};

/// ODOMETRY: Pose of child frame in frame_id and velocity in the child frame: m, m/s, rad/s; q = (w, x, y, z).
/// Covariances are upper triangles, row-major; NaN first: unknown. quality in %, 0 unknown, −1 failed.
struct Odometry {
  static constexpr std::uint32_t kId = 331;
  static constexpr std::string_view kName = "ODOMETRY";
  std::uint64_t time_usec = 0;
  float x = 0, y = 0, z = 0;
  std::array<float, 4> q{};
  float vx = 0, vy = 0, vz = 0, rollspeed = 0, pitchspeed = 0, yawspeed = 0;
  std::array<float, 21> pose_covariance{}, velocity_covariance{};
  std::uint8_t frame_id = 0, child_frame_id = 0, reset_counter = 0, estimator_type = 0;
  std::int8_t quality = 0;
  static constexpr auto fields() noexcept {
    using M = Odometry;
    return std::tuple{field("time_usec", &M::time_usec),
                      field("x", &M::x),
                      field("y", &M::y),
                      field("z", &M::z),
                      field("q", &M::q),
                      field("vx", &M::vx),
                      field("vy", &M::vy),
                      field("vz", &M::vz),
                      field("rollspeed", &M::rollspeed),
                      field("pitchspeed", &M::pitchspeed),
                      field("yawspeed", &M::yawspeed),
                      field("pose_covariance", &M::pose_covariance),
                      field("velocity_covariance", &M::velocity_covariance),
                      field("frame_id", &M::frame_id),
                      field("child_frame_id", &M::child_frame_id),
                      extension("reset_counter", &M::reset_counter),
                      extension("estimator_type", &M::estimator_type),
                      extension("quality", &M::quality)};
  }
};

/// VISION_POSITION_ESTIMATE: Pose from vision: NED, m, rad; covariance as in Odometry.
struct VisionPositionEstimate {
  static constexpr std::uint32_t kId = 102;
  static constexpr std::string_view kName = "VISION_POSITION_ESTIMATE";
  std::uint64_t usec = 0;
  float x = 0, y = 0, z = 0, roll = 0, pitch = 0, yaw = 0;
  std::array<float, 21> covariance{};
  std::uint8_t reset_counter = 0;
  static constexpr auto fields() noexcept {
    using M = VisionPositionEstimate;
    return std::tuple{field("usec", &M::usec),
                      field("x", &M::x),
                      field("y", &M::y),
                      field("z", &M::z),
                      field("roll", &M::roll),
                      field("pitch", &M::pitch),
                      field("yaw", &M::yaw),
                      extension("covariance", &M::covariance),
                      extension("reset_counter", &M::reset_counter)};
  }
};

/// OBSTACLE_DISTANCE: Distances around the vehicle, cm (65535: unknown), clockwise in steps of increment (degrees).
struct ObstacleDistance {
  static constexpr std::uint32_t kId = 330;
  static constexpr std::string_view kName = "OBSTACLE_DISTANCE";
  std::uint64_t time_usec = 0;
  std::array<std::uint16_t, 72> distances{};
  std::uint16_t min_distance = 0, max_distance = 0;
  std::uint8_t sensor_type = 0, increment = 0;
  float increment_f = 0, angle_offset = 0;
  std::uint8_t frame = 0;
  static constexpr auto fields() noexcept {
    using M = ObstacleDistance;
    return std::tuple{field("time_usec", &M::time_usec),
                      field("distances", &M::distances),
                      field("min_distance", &M::min_distance),
                      field("max_distance", &M::max_distance),
                      field("sensor_type", &M::sensor_type),
                      field("increment", &M::increment),
                      extension("increment_f", &M::increment_f),
                      extension("angle_offset", &M::angle_offset),
                      extension("frame", &M::frame)};
  }
};

/// PARAM_REQUEST_READ: Asks for one parameter by name (param_index −1) or index.
struct ParamRequestRead {
  static constexpr std::uint32_t kId = 20;
  static constexpr std::string_view kName = "PARAM_REQUEST_READ";
  std::int16_t param_index = 0;
  std::uint8_t target_system = 0, target_component = 0;
  std::array<char, 16> param_id{};
  static constexpr auto fields() noexcept {
    using M = ParamRequestRead;
    return std::tuple{field("param_index", &M::param_index), field("target_system", &M::target_system),
                      field("target_component", &M::target_component), field("param_id", &M::param_id)};
  }
};

/// PARAM_ERROR: Why a question for a parameter is not answered: error as MAV_PARAM_ERROR, 1 there is none of this name.
struct ParamError {
  static constexpr std::uint32_t kId = 345;
  static constexpr std::string_view kName = "PARAM_ERROR";
  std::int16_t param_index = 0;
  std::uint8_t target_system = 0, target_component = 0;
  std::array<char, 16> param_id{};
  std::uint8_t error = 0;
  static constexpr auto fields() noexcept {
    using M = ParamError;
    return std::tuple{field("param_index", &M::param_index), field("target_system", &M::target_system),
                      field("target_component", &M::target_component), field("param_id", &M::param_id),
                      field("error", &M::error)};
  }
};
static_assert(info<ParamError>().crc_extra == 209);  // work in progress in common.xml: as ArduPilot 4.7 sends it

/// PARAM_SET: Sets a parameter; encoding as in ParamValue.
struct ParamSet {
  static constexpr std::uint32_t kId = 23;
  static constexpr std::string_view kName = "PARAM_SET";
  float param_value = 0;
  std::uint8_t target_system = 0, target_component = 0;
  std::array<char, 16> param_id{};
  std::uint8_t param_type = 0;
  static constexpr auto fields() noexcept {
    using M = ParamSet;
    return std::tuple{field("param_value", &M::param_value), field("target_system", &M::target_system),
                      field("target_component", &M::target_component), field("param_id", &M::param_id),
                      field("param_type", &M::param_type)};
  }
};

/// SET_GPS_GLOBAL_ORIGIN: Where the local frame's origin lies: 1e-7 degrees, mm above the sea.
struct SetGpsGlobalOrigin {
  static constexpr std::uint32_t kId = 48;
  static constexpr std::string_view kName = "SET_GPS_GLOBAL_ORIGIN";
  std::int32_t latitude = 0, longitude = 0, altitude = 0;
  std::uint8_t target_system = 0;
  std::uint64_t time_usec = 0;
  static constexpr auto fields() noexcept {
    using M = SetGpsGlobalOrigin;
    return std::tuple{field("latitude", &M::latitude), field("longitude", &M::longitude),
                      field("altitude", &M::altitude), field("target_system", &M::target_system),
                      extension("time_usec", &M::time_usec)};
  }
};

/// GPS_GLOBAL_ORIGIN: the same, as the autopilot has it.
struct GpsGlobalOrigin {
  static constexpr std::uint32_t kId = 49;
  static constexpr std::string_view kName = "GPS_GLOBAL_ORIGIN";
  std::int32_t latitude = 0, longitude = 0, altitude = 0;
  std::uint64_t time_usec = 0;
  static constexpr auto fields() noexcept {
    using M = GpsGlobalOrigin;
    return std::tuple{field("latitude", &M::latitude), field("longitude", &M::longitude),
                      field("altitude", &M::altitude), extension("time_usec", &M::time_usec)};
  }
};

}  // namespace backwash::mavlink
