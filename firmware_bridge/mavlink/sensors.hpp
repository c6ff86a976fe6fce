// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "firmware_bridge/mavlink/codec.hpp"

// Messages of common.xml: what sensors and the estimator of a flight controller tell. Values are raw, as on the wire
// (NED, FRD, the units named here); fields() lists the members in wire order, extensions last: it is all that the codec
// knows of a message.

namespace backwash::mavlink {

/// HIGHRES_IMU: Body FRD: specific force m/s², rates rad/s, field gauss; pressure hPa, altitude m, temperature °C.
/// fields_updated names the valid ones.
struct HighresImu {
  static constexpr std::uint32_t kId = 105;
  static constexpr std::string_view kName = "HIGHRES_IMU";
  std::uint64_t time_usec = 0;
  float xacc = 0, yacc = 0, zacc = 0, xgyro = 0, ygyro = 0, zgyro = 0, xmag = 0, ymag = 0, zmag = 0, abs_pressure = 0,
        diff_pressure = 0, pressure_alt = 0, temperature = 0;
  std::uint16_t fields_updated = 0;
  std::uint8_t id = 0;
  static constexpr auto fields() noexcept {
    using M = HighresImu;
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

/// RAW_IMU: Raw counts of the sensor's own scale.
struct RawImu {
  static constexpr std::uint32_t kId = 27;
  static constexpr std::string_view kName = "RAW_IMU";
  std::uint64_t time_usec = 0;
  std::int16_t xacc = 0, yacc = 0, zacc = 0, xgyro = 0, ygyro = 0, zgyro = 0, xmag = 0, ymag = 0, zmag = 0;
  std::uint8_t id = 0;
  std::int16_t temperature = 0;
  static constexpr auto fields() noexcept {
    using M = RawImu;
    return std::tuple{
        field("time_usec", &M::time_usec), field("xacc", &M::xacc),   field("yacc", &M::yacc),
        field("zacc", &M::zacc),           field("xgyro", &M::xgyro), field("ygyro", &M::ygyro),
        field("zgyro", &M::zgyro),         field("xmag", &M::xmag),   field("ymag", &M::ymag),
        field("zmag", &M::zmag),           extension("id", &M::id),   extension("temperature", &M::temperature)};
  }
};

/// SCALED_IMU2: Body FRD: specific force in mG, rates in mrad/s, field in mgauss, temperature in 0.01 °C (0: unknown).
struct ScaledImu2 {
  static constexpr std::uint32_t kId = 116;
  static constexpr std::string_view kName = "SCALED_IMU2";
  std::uint32_t time_boot_ms = 0;
  std::int16_t xacc = 0, yacc = 0, zacc = 0, xgyro = 0, ygyro = 0, zgyro = 0, xmag = 0, ymag = 0, zmag = 0,
               temperature = 0;
  static constexpr auto fields() noexcept {
    using M = ScaledImu2;
    return std::tuple{field("time_boot_ms", &M::time_boot_ms),
                      field("xacc", &M::xacc),
                      field("yacc", &M::yacc),
                      field("zacc", &M::zacc),
                      field("xgyro", &M::xgyro),
                      field("ygyro", &M::ygyro),
                      field("zgyro", &M::zgyro),
                      field("xmag", &M::xmag),
                      field("ymag", &M::ymag),
                      field("zmag", &M::zmag),
                      extension("temperature", &M::temperature)};
  }
};

/// ESTIMATOR_STATUS: Innovation test ratios and accuracies (m) of the controller's estimator; flags:
/// ESTIMATOR_STATUS_FLAGS.
struct EstimatorStatus {
  static constexpr std::uint32_t kId = 230;
  static constexpr std::string_view kName = "ESTIMATOR_STATUS";
  std::uint64_t time_usec = 0;
  float vel_ratio = 0, pos_horiz_ratio = 0, pos_vert_ratio = 0, mag_ratio = 0, hagl_ratio = 0, tas_ratio = 0,
        pos_horiz_accuracy = 0, pos_vert_accuracy = 0;
  std::uint16_t flags = 0;
  static constexpr auto fields() noexcept {
    using M = EstimatorStatus;
    return std::tuple{field("time_usec", &M::time_usec),
                      field("vel_ratio", &M::vel_ratio),
                      field("pos_horiz_ratio", &M::pos_horiz_ratio),
                      field("pos_vert_ratio", &M::pos_vert_ratio),
                      field("mag_ratio", &M::mag_ratio),
                      field("hagl_ratio", &M::hagl_ratio),
                      field("tas_ratio", &M::tas_ratio),
                      field("pos_horiz_accuracy", &M::pos_horiz_accuracy),
                      field("pos_vert_accuracy", &M::pos_vert_accuracy),
                      field("flags", &M::flags)};
  }
};

/// EKF_STATUS_REPORT: of ArduPilot's estimator: flags as ESTIMATOR_STATUS's, innovations over their bounds.
struct EkfStatusReport {
  static constexpr std::uint32_t kId = 193;
  static constexpr std::string_view kName = "EKF_STATUS_REPORT";
  float velocity_variance = 0, pos_horiz_variance = 0, pos_vert_variance = 0, compass_variance = 0,
        terrain_alt_variance = 0;
  std::uint16_t flags = 0;
  float airspeed_variance = 0;
  static constexpr auto fields() noexcept {
    using M = EkfStatusReport;
    return std::tuple{
        field("velocity_variance", &M::velocity_variance),       field("pos_horiz_variance", &M::pos_horiz_variance),
        field("pos_vert_variance", &M::pos_vert_variance),       field("compass_variance", &M::compass_variance),
        field("terrain_alt_variance", &M::terrain_alt_variance), field("flags", &M::flags),
        extension("airspeed_variance", &M::airspeed_variance)};
  }
};

/// AUTOPILOT_VERSION: flight_sw_version is major, minor, patch and type, a byte each, the first in the highest.
struct AutopilotVersion {
  static constexpr std::uint32_t kId = 148;
  static constexpr std::string_view kName = "AUTOPILOT_VERSION";
  std::uint64_t capabilities = 0, uid = 0;
  std::uint32_t flight_sw_version = 0, middleware_sw_version = 0, os_sw_version = 0, board_version = 0;
  std::uint16_t vendor_id = 0, product_id = 0;
  std::array<std::uint8_t, 8> flight_custom_version{}, middleware_custom_version{}, os_custom_version{};
  std::array<std::uint8_t, 18> uid2{};
  static constexpr auto fields() noexcept {
    using M = AutopilotVersion;
    return std::tuple{field("capabilities", &M::capabilities),
                      field("uid", &M::uid),
                      field("flight_sw_version", &M::flight_sw_version),
                      field("middleware_sw_version", &M::middleware_sw_version),
                      field("os_sw_version", &M::os_sw_version),
                      field("board_version", &M::board_version),
                      field("vendor_id", &M::vendor_id),
                      field("product_id", &M::product_id),
                      field("flight_custom_version", &M::flight_custom_version),
                      field("middleware_custom_version", &M::middleware_custom_version),
                      field("os_custom_version", &M::os_custom_version),
                      extension("uid2", &M::uid2)};
  }
};

}  // namespace backwash::mavlink
