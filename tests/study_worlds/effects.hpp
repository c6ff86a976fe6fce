// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>

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

/// A cause with its size s (signed, in its unit) and its drawn shape in a world, and when it acts.
struct Acting {
  const HiddenWorld& world;
  const Instant& now;
  double s, shape;
};

/// The value that a parameter of the study has in truth, of size and shape; nothing where the units differ.
using Truth = std::function<std::optional<double>(double s, double shape)>;

/// All that the generator knows of a cause. One that is no push and no factor on the variance acts in fly.cpp.
struct HiddenCause {
  double size;              ///< that must be found at 12 flights; table and units: docs/measurements/confusion.md
  bool one_signed = false;  ///< else its sign is drawn
  std::function<double(std::mt19937_64&)> shape = {};     ///< draws the second number; without it a direction, rad
  std::function<Vec3(const Acting&)> push = {};           ///< on the craft, m/s² in W
  std::function<double(const Acting&)> ln_variance = {};  ///< ln of the factor on the disturbance's variance
  std::map<std::string, Truth> truth = {};                ///< by the study's name of the parameter
};
/// By name; "unknown" is one that no name of the catalogue covers.
const std::map<std::string, HiddenCause>& causes();

/// Push on the craft, m/s² in W, by every effect of the mean.
Vec3 hidden_push(const HiddenWorld& world, const Instant& now);
/// ln of the factor on the disturbance's variance, by every effect of it.
double hidden_ln_variance(const HiddenWorld& world, const Instant& now);

}  // namespace study_worlds
