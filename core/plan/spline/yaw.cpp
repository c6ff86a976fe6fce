// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/spline/yaw.hpp"

#include <algorithm>
#include <cmath>

#include "core/types/angle.hpp"
#include "core/types/geometry.hpp"
#include "core/types/minimum_jerk.hpp"

namespace backwash::plan {
namespace {

constexpr std::size_t kAhead = 20;  ///< commands
constexpr double kLeast = 0.05;     ///< m: a shorter way ahead has no direction

/// Fastest rate from which `angle` can still be braked in whole periods.
double braking_rate(double angle, double acceleration) {
  const double step = acceleration * kControlPeriod / 2;
  return std::sqrt(step * step + 2 * acceleration * angle) - step;
}

}  // namespace

std::vector<Setpoint> facing_ahead(std::vector<Setpoint> commands, const YawStart& start, const YawLimits& limits) {
  double yaw = start.yaw, rate = start.rate, target = start.yaw;
  const std::size_t count = commands.size();
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3 ahead = commands[std::min(k + kAhead, count - 1)].p_W - commands[k].p_W;
    if (ahead.head<2>().norm() > kLeast) {
      const double heading = std::atan2(ahead.y(), ahead.x());
      target = yaw + wrap_angle(heading - yaw);
    }
    const double error = target - yaw, change = limits.acceleration * kControlPeriod;
    // Braking takes what is left of the commands, this one excluded.
    const double fastest = std::min(
        {limits.rate, braking_rate(std::abs(error), limits.acceleration), change * static_cast<double>(count - 1 - k)});
    rate += std::clamp(std::copysign(fastest, error) - rate, -change, change);
    yaw += rate * kControlPeriod;
    commands[k].yaw = yaw;
  }
  return commands;
}

std::vector<Setpoint> turned_to(const Setpoint& at, double yaw, const YawLimits& limits) {
  constexpr double kReached = 1e-3;  // rad
  const double angle = wrap_angle(yaw - at.yaw);
  if (std::abs(angle) < kReached || !(limits.rate > 0 && limits.acceleration > 0)) return {};
  constexpr double kToSpare = 1.1;  // for the steps
  const double T = kToSpare * minimum_jerk_duration(std::abs(angle), limits.rate, limits.acceleration);
  const double steps = std::ceil(T / kControlPeriod) + 1;
  std::vector<Setpoint> commands;
  for (double k = 1; k <= steps; ++k)
    commands.push_back({at.p_W, Vec3::Zero(), Vec3::Zero(), at.yaw + minimum_jerk(k / steps).value * angle});
  return commands;
}

}  // namespace backwash::plan
