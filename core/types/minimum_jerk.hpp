// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/types/state.hpp"

namespace backwash {

/// The minimum-jerk profile from 0 to 1 while s goes from 0 to 1, rest to rest, and its derivatives by s.
struct MinimumJerk {
  double value, first, second;
};
inline MinimumJerk minimum_jerk(double s) noexcept {
  return {s * s * s * (10 - 15 * s + 6 * s * s), 30 * s * s * (1 - s) * (1 - s), 60 * s * (1 - s) * (1 - 2 * s)};
}

/// Least duration of such a motion over `length` within a speed and an acceleration, s; all in one unit of length: the
/// profile's peaks are 15/8 and 10/√3.
inline double minimum_jerk_duration(double length, double speed, double acceleration) {
  return std::max(15.0 / 8 * length / speed, std::sqrt(10 / std::numbers::sqrt3 * length / acceleration));
}

/// Commands every 20 ms on the straight line between two points (m, W), the first at `from` and the last at `to`, with
/// that profile within the limits (m/s and m/s² along the line).
inline std::vector<Setpoint> rest_to_rest(const Vec3& from_W, const Vec3& to_W, double v_max, double a_max) {
  const Vec3 way = to_W - from_W;
  const double least = minimum_jerk_duration(way.norm(), v_max, a_max);
  const auto periods = static_cast<std::size_t>(std::max(1.0, std::ceil(least / kControlPeriod)));
  const double T = static_cast<double>(periods) * kControlPeriod;
  std::vector<Setpoint> commands(periods + 1);
  for (std::size_t k = 0; k <= periods; ++k) {
    const auto [value, first, second] = minimum_jerk(static_cast<double>(k) / static_cast<double>(periods));
    commands[k].p_W = from_W + value * way;
    commands[k].v_W = first / T * way;
    commands[k].a_W = second / (T * T) * way;
  }
  return commands;
}

}  // namespace backwash
