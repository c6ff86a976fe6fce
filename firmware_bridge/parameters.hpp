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
/// `untold_delay`: of the line (untold_delay(), line_budget.hpp), s; where there is one, the controller must be told.
std::vector<ParameterFinding> judge_parameters(Autopilot autopilot, const ParameterValues& values,
                                               const Vehicle& vehicle, double untold_delay = 0);
inline constexpr double kGainTolerance = 0.10;

/// From our last set-point to when the autopilot no longer follows it, s, at most (docs/faults.md row 36).
inline constexpr double kLastMotion = 0.5;

/// How old odometry may be at most when it reaches us, s (docs/faults.md row 1): more is no delay of a VIO's.
inline constexpr double kLatestVio = 0.08;

/// "", or the first required parameter that is not good, its value and what to set. `or_unknown`: one that the
/// controller has not told counts too.
std::string forbidding_parameter(Autopilot autopilot, const ParameterValues& values, const Vehicle& vehicle,
                                 double untold_delay = 0, bool or_unknown = true);

}  // namespace backwash::firmware_bridge
