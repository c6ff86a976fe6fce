// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>

#include "core/types/vehicle.hpp"
#include "firmware_bridge/autopilots/profile.hpp"

namespace backwash::services {

/// An autopilot's parameters, whose they are, and which could not be taken. k_d is the velocity gain, k_p the product
/// of the two (Ask).
struct Firmware {
  const firmware_bridge::AutopilotProfile* autopilot = &firmware_bridge::kPx4;
  std::map<std::string, double> values;
  std::string left_out;

  /// Its parameter's name in these values, or the newest; empty where it has none for that.
  std::string name(firmware_bridge::Ask ask) const;
};

/// The gains of `values` in place of the vehicle's. Throws Failure 65, at `path`, where they are incomplete.
Firmware take_gains(const std::map<std::string, double>& values, const std::string& path, Vehicle& vehicle);

/// What a parameter lets a vehicle do, in our unit (lean: degrees).
struct Granted {
  std::string name;
  double value;
};
/// The least of what any autopilot's parameters grant of an Ask (v_max, a_max, lean); none where these values lack it.
std::optional<Granted> least_granted(const std::map<std::string, double>& values, firmware_bridge::Ask ask);

}  // namespace backwash::services
