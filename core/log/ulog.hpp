// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "core/log/flight_log.hpp"

namespace backwash::log {

/// A ULog file by topic. Values of every numeric field are kept as doubles; nested types and arrays become `name.field`
/// and `name[3]`; padding is dropped.
struct ULog {
  struct Topic {
    std::string name;
    unsigned instance;
    std::vector<double> t_s;                             ///< timestamps, s since the controller's start
    std::map<std::string, std::vector<double>> columns;  ///< field → one value per message
  };
  std::vector<Topic> topics;
  std::size_t dropouts = 0;
  double dropped_s = 0;
  const Topic* find(const std::string& name, unsigned instance = 0) const;
};

/// Decodes the ULog format (docs.px4.io, ULog File Format): header, flag bits with appended data, formats,
/// subscriptions, data, dropouts; other messages are passed over. A last message cut short is dropped (a log ends
/// without warning). Error: one line with the byte offset, for a wrong magic, unknown incompatible flags, a format that
/// cannot be, data without a subscription or of a wrong size.
tl::expected<ULog, std::string> decode_ulog(std::span<const std::uint8_t> bytes);

/// A flight log (docs/interfaces.md) of a decoded ULog: vehicle_local_position, vehicle_attitude, trajectory_setpoint,
/// battery_status, actuator_outputs/actuator_motors, vehicle_thrust_setpoint or the thrust of
/// vehicle_attitude_setpoint; NED/FRD turned into z-up and x forward, y left, z up. Rows are those of the local
/// position. If those are rarer than 20 Hz, rows are the accelerometer's (vehicle_acceleration or sensor_combined;
/// means down to 100 Hz), positions a cubic between messages, and accelerations the specific force turned by the
/// attitude; a gap of positions above 0.5 s, and a reset of the estimator, is one of the rows. Other topics are joined
/// by their latest value before, and left out where they are missing. Error: the topic that is missing.
tl::expected<FlightLog, std::string> flight_of(const ULog& ulog);

/// Reads a file as a flight log. Errors: not_found; bad_data with the offset, or the topic that is missing.
tl::expected<FlightLog, LogError> read_ulog(const std::string& path);

}  // namespace backwash::log
