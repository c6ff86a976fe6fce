// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "core/log/autopilot/log_loss.hpp"
#include "core/log/columns/flight_log.hpp"

namespace backwash::log {

/// An autopilot's log by topic, under PX4's names, units and frames (NED, FRD). Values of every numeric field are kept
/// as doubles.
struct TopicLog {
  struct Topic {
    std::string name;
    unsigned instance;
    std::vector<double> t_s;                             ///< timestamps, s since the controller's start
    std::map<std::string, std::vector<double>> columns;  ///< field → one value per message
  };
  std::vector<Topic> topics;
  std::map<std::string, double> parameters = {};  ///< the autopilot's, by name, as they were last
  std::vector<std::string> texts = {};            ///< what the autopilot said of itself
  LogLoss loss = {};                              ///< of the file
  const Topic* find(const std::string& name, unsigned instance = 0) const;
  /// Takes out of each topic the fewest messages without which its times never fall, damage that looks like messages,
  /// and counts them as lost.
  void drop_misplaced();
};

/// A flight log (docs/interfaces.md) of a decoded one: vehicle_local_position, vehicle_attitude, trajectory_setpoint,
/// battery_status, actuator_outputs/actuator_motors, vehicle_thrust_setpoint or the thrust of
/// vehicle_attitude_setpoint; NED/FRD turned into z-up and x forward, y left, z up. Rows are those of the local
/// position. If those are rarer than 20 Hz, rows are the accelerometer's (vehicle_acceleration or sensor_combined;
/// means down to 100 Hz), positions a cubic between messages, and accelerations the specific force turned by the
/// attitude; a gap of positions above 0.5 s, and a reset of the estimator, is one of the rows. Other topics are joined
/// by their latest value before, and left out where they are missing. What is lost or left out stands in the log's
/// notes. Error: the topic that is missing, and what of the file is lost.
tl::expected<FlightLog, std::string> flight_of(const TopicLog& topics);

/// The content of an autopilot's log, unpacked. Errors: not_found, bad_data.
tl::expected<std::string, LogError> read_topic_file(const std::string& path, const std::string& wanted);

/// Reads a file, decodes it and makes its flight log. `wanted`: what the path should name. Errors: not_found; bad_data
/// with what the decoder says, or the topic that is missing.
tl::expected<FlightLog, LogError> read_topics(
    const std::string& path, const std::string& wanted,
    tl::expected<TopicLog, std::string> (*decode)(std::span<const std::uint8_t> bytes));

}  // namespace backwash::log
