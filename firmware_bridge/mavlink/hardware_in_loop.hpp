// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "firmware_bridge/mavlink/codec.hpp"

// Messages of common.xml: what passes between a simulator and a controller in the loop. Values are raw, as on the wire
// (NED, FRD, the units named here); fields() lists the members in wire order, extensions last: it is all that the codec
// knows of a message.

namespace backwash::mavlink {

/// HIL_SENSOR: Simulated sensors for a controller in the loop; units as in HighresImu.
struct HilSensor {
  static constexpr std::uint32_t kId = 107;
  static constexpr std::string_view kName = "HIL_SENSOR";
  std::uint64_t time_usec = 0;
  float xacc = 0, yacc = 0, zacc = 0, xgyro = 0, ygyro = 0, zgyro = 0, xmag = 0, ymag = 0, zmag = 0, abs_pressure = 0,
        diff_pressure = 0, pressure_alt = 0, temperature = 0;
  std::uint32_t fields_updated = 0;
  std::uint8_t id = 0;
  static constexpr auto fields() noexcept {
    using M = HilSensor;
    return std::tuple{field("time_usec", &M::time_usec),
                      field("xacc", &M::xacc),
                      field("yacc", &M::yacc),
                      field("zacc", &M::zacc),
                      field("xgyro", &M::xgyro),
                      field("ygyro", &M::ygyro),
                      field("zgyro", &M::zgyro),
                      field("xmag", &M::xmag),
                      field("ymag", &M::ymag),
                      field("zmag", &M::zmag),
                      field("abs_pressure", &M::abs_pressure),
                      field("diff_pressure", &M::diff_pressure),
                      field("pressure_alt", &M::pressure_alt),
                      field("temperature", &M::temperature),
                      field("fields_updated", &M::fields_updated),
                      extension("id", &M::id)};
  }
};

/// HIL_GPS: Simulated satellite receiver: 1e-7 degrees, mm, cm, cm/s, cdeg.
struct HilGps {
  static constexpr std::uint32_t kId = 113;
  static constexpr std::string_view kName = "HIL_GPS";
  std::uint64_t time_usec = 0;
  std::int32_t lat = 0, lon = 0, alt = 0;
  std::uint16_t eph = 0, epv = 0, vel = 0;
  std::int16_t vn = 0, ve = 0, vd = 0;
  std::uint16_t cog = 0;
  std::uint8_t fix_type = 0, satellites_visible = 0, id = 0;
  std::uint16_t yaw = 0;
  static constexpr auto fields() noexcept {
    using M = HilGps;
    return std::tuple{field("time_usec", &M::time_usec),
                      field("lat", &M::lat),
                      field("lon", &M::lon),
                      field("alt", &M::alt),
                      field("eph", &M::eph),
                      field("epv", &M::epv),
                      field("vel", &M::vel),
                      field("vn", &M::vn),
                      field("ve", &M::ve),
                      field("vd", &M::vd),
                      field("cog", &M::cog),
                      field("fix_type", &M::fix_type),
                      field("satellites_visible", &M::satellites_visible),
                      extension("id", &M::id),
                      extension("yaw", &M::yaw)};
  }
};

/// HIL_ACTUATOR_CONTROLS: Actuator commands of a controller in the loop, −1…1.
struct HilActuatorControls {
  static constexpr std::uint32_t kId = 93;
  static constexpr std::string_view kName = "HIL_ACTUATOR_CONTROLS";
  std::uint64_t time_usec = 0, flags = 0;
  std::array<float, 16> controls{};
  std::uint8_t mode = 0;
  static constexpr auto fields() noexcept {
    using M = HilActuatorControls;
    return std::tuple{field("time_usec", &M::time_usec), field("flags", &M::flags), field("controls", &M::controls),
                      field("mode", &M::mode)};
  }
};

/// HIL_STATE_QUATERNION: Simulated truth: q = (w, x, y, z), rad/s, 1e-7 degrees, mm, cm/s, mG.
struct HilStateQuaternion {
  static constexpr std::uint32_t kId = 115;
  static constexpr std::string_view kName = "HIL_STATE_QUATERNION";
  std::uint64_t time_usec = 0;
  std::array<float, 4> attitude_quaternion{};
  float rollspeed = 0, pitchspeed = 0, yawspeed = 0;
  std::int32_t lat = 0, lon = 0, alt = 0;
  std::int16_t vx = 0, vy = 0, vz = 0;
  std::uint16_t ind_airspeed = 0, true_airspeed = 0;
  std::int16_t xacc = 0, yacc = 0, zacc = 0;
  static constexpr auto fields() noexcept {
    using M = HilStateQuaternion;
    return std::tuple{field("time_usec", &M::time_usec),
                      field("attitude_quaternion", &M::attitude_quaternion),
                      field("rollspeed", &M::rollspeed),
                      field("pitchspeed", &M::pitchspeed),
                      field("yawspeed", &M::yawspeed),
                      field("lat", &M::lat),
                      field("lon", &M::lon),
                      field("alt", &M::alt),
                      field("vx", &M::vx),
                      field("vy", &M::vy),
                      field("vz", &M::vz),
                      field("ind_airspeed", &M::ind_airspeed),
                      field("true_airspeed", &M::true_airspeed),
                      field("xacc", &M::xacc),
                      field("yacc", &M::yacc),
                      field("zacc", &M::zacc)};
  }
};

/// SIM_STATE: ArduPilot's simulated truth: q = (w, x, y, z), rad, m/s² with gravity, rad/s, degrees, m above the sea,
/// m/s in NED; lat_int and lon_int in 1e-7 degrees (a float has no more than 0.4 m).
struct SimState {
  static constexpr std::uint32_t kId = 108;
  static constexpr std::string_view kName = "SIM_STATE";
  float q1 = 0, q2 = 0, q3 = 0, q4 = 0, roll = 0, pitch = 0, yaw = 0, xacc = 0, yacc = 0, zacc = 0, xgyro = 0,
        ygyro = 0, zgyro = 0, lat = 0, lon = 0, alt = 0, std_dev_horz = 0, std_dev_vert = 0, vn = 0, ve = 0, vd = 0;
  std::int32_t lat_int = 0, lon_int = 0;
  static constexpr auto fields() noexcept {
    using M = SimState;
    return std::tuple{field("q1", &M::q1),
                      field("q2", &M::q2),
                      field("q3", &M::q3),
                      field("q4", &M::q4),
                      field("roll", &M::roll),
                      field("pitch", &M::pitch),
                      field("yaw", &M::yaw),
                      field("xacc", &M::xacc),
                      field("yacc", &M::yacc),
                      field("zacc", &M::zacc),
                      field("xgyro", &M::xgyro),
                      field("ygyro", &M::ygyro),
                      field("zgyro", &M::zgyro),
                      field("lat", &M::lat),
                      field("lon", &M::lon),
                      field("alt", &M::alt),
                      field("std_dev_horz", &M::std_dev_horz),
                      field("std_dev_vert", &M::std_dev_vert),
                      field("vn", &M::vn),
                      field("ve", &M::ve),
                      field("vd", &M::vd),
                      extension("lat_int", &M::lat_int),
                      extension("lon_int", &M::lon_int)};
  }
};

}  // namespace backwash::mavlink
