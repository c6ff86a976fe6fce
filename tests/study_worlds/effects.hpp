// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tests/study_worlds/world.hpp"

namespace study_worlds {

/// Where and how the craft flies at an instant; what effects depend on.
struct Instant {
  double t;             ///< s since the flight's start
  Vec3 p, v;            ///< m, m/s
  double yaw;           ///< rad
  double thrust_acc;    ///< T/m that the simulation believes, m/s²
  double voltage_drop;  ///< (nominal − loaded)/nominal
  double temperature;   ///< °C
};

/// Push on the craft, m/s² in W, by every effect of the mean.
Vec3 hidden_push(const World& world, const Instant& now);
/// ln of the factor on the disturbance's variance, and its long-time mean removed: nothing.
double hidden_ln_variance(const World& world, const Instant& now);

}  // namespace study_worlds
