// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/types/vehicle.hpp"
#include "firmware_bridge/telemetry.hpp"

namespace backwash::firmware_bridge {

/// Names of the flight controller's parameters on which a promise of ours rests, in the order of ParameterValues; those
/// without which control is not taken come first. Empty for a controller that has none (the plain link) or that is not
/// known. Sources: docs/autopilots.md. Real-time: wait-free.
std::span<const std::string_view> parameter_names(Autopilot autopilot) noexcept;

inline constexpr std::size_t kMostParameters = 24;
/// As the controller answered; absent: not yet.
using ParameterValues = std::array<std::optional<double>, kMostParameters>;

/// What is to be said of one of them.
struct ParameterFinding {
  std::string_view name;
  bool required = false;  ///< control is not taken unless it is good
  bool good = false;      ///< false also where the controller has not answered
  std::optional<double> value;
  std::string advice;  ///< what to set, and why; empty when good
};
/// All of parameter_names(). Gains and limits are judged against the vehicle file: a set that was computed for other
/// gains (more than kGainTolerance away in k_p or k_d), or for a motion that the controller cuts off, is no promise.
std::vector<ParameterFinding> judge_parameters(Autopilot autopilot, const ParameterValues& values,
                                               const Vehicle& vehicle);
inline constexpr double kGainTolerance = 0.10;

/// "", or the first required parameter that is not good, its value and what to set.
std::string forbidding_parameter(Autopilot autopilot, const ParameterValues& values, const Vehicle& vehicle);

}  // namespace backwash::firmware_bridge
