// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "core/types/minimum_jerk.hpp"
#include "core/types/state.hpp"

namespace backwash::daemon::test {

/// Back to `home` within 4 s, then figures of eight before it at up to 1.4 m/s and 1.9 m/s², the heading turning at up
/// to 1 rad/s.
inline std::vector<Setpoint> eights(const Setpoint& from, const Vec3& home, double seconds) {
  std::vector<Setpoint> commands;
  const Vec3 way = home - from.p_W;
  for (double t = 0; t < 4; t += kControlPeriod) {
    const auto [s, v, a] = minimum_jerk(t / 4);
    commands.push_back({from.p_W + s * way, v / 4 * way, a / 16 * way, from.yaw});
  }
  for (double t = 0; t < seconds; t += kControlPeriod) {
    const auto swing = [t](double amplitude, double omega) {  // from rest
      const double s = std::sin(omega * t), c = std::cos(omega * t);
      return std::array{amplitude * (1 - c), amplitude * omega * s, amplitude * omega * omega * c};
    };
    const auto x = swing(1.1, 1.25), y = swing(0.15, 2.5), z = swing(0.2, 0.7), yaw = swing(1.2, 0.8);
    commands.push_back({home + Vec3(x[0], y[0], z[0]), {x[1], y[1], z[1]}, {x[2], y[2], z[2]}, from.yaw + yaw[0]});
  }
  return commands;
}

}  // namespace backwash::daemon::test
