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

}  // namespace backwash::mavlink
