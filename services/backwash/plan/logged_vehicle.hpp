// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/log/mcap/topic_log.hpp"
#include "core/types/vehicle.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {

/// A number that a flight shows: the middle of its parts, and what they scatter over.
struct Shown {
  double value, low, high;
};

/// What one autopilot's log says of its vehicle.
struct LoggedVehicle {
  std::string path;
  std::string kind;  ///< "a ULog of PX4"
  log::TopicLog topics;
  log::FlightLog flight;
  std::optional<Shown> hover;         ///< thrust command, of windows of 2 s slower than 3 m/s: median, 5 and 95 %
  std::optional<Shown> attitude_lag;  ///< s, first order, of the tilt behind its set-point; of four quarters
  std::size_t hover_windows = 0;      ///< slower than 0.5 m/s
  double airborne_s = 0;
};

/// Reads an autopilot's log, whatever it is called. Throws Failure, also for another kind.
LoggedVehicle logged_vehicle(const std::string& path);

/// A key of the vehicle file, and whether a parameter, the flight or nothing says it.
struct SourcedValue {
  std::string key;  ///< with its table: "body.mass"
  double value;
  std::string source;  ///< "parameter MPC_XY_P", "fitted, 0.14 to 0.17", "default: weigh it"
};
std::vector<SourcedValue> sourced_values(const LoggedVehicle& logged);

/// The hover's thrust command as a parameter states it, by its name.
std::optional<std::pair<std::string, double>> stated_hover(const std::map<std::string, double>& parameters);

/// What the hover of a log contradicts in a vehicle file, a sentence; empty: nothing, or the log does not hover.
std::string another_vehicle(const log::FlightLog& log, const Vehicle& vehicle);

/// `vehicle from`: a vehicle file from one log.
Verb vehicle_from_verb(Command& group);

}  // namespace backwash::services
