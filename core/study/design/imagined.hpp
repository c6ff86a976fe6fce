// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/study/windows/observation.hpp"
#include "core/types/state.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::study {

/// The windows that a commanded flight would give, of which nothing is measured yet: made by the same code from the
/// closed loop's own motion, without gusts. Weights are those of windows with as strong gusts as were flown.
class Imagination {
 public:
  /// Keeps a pointer to `flown`, and to `surroundings`, of the same map.
  Imagination(const Observations& flown, const Vehicle& vehicle, MapView& surroundings);
  /// `commands`: 20 ms apart. Voltage and temperature are those of the mean course of the flown flights;
  /// `used_battery`: the voltage goes on from where the longest of them ended.
  Observations windows(const std::vector<Setpoint>& commands, bool used_battery) const;
  /// The voltage at take-off, V; nothing without the column.
  std::optional<double> first_voltage(bool used_battery) const;

 private:
  const Observations* flown_;
  Vehicle vehicle_;
  MapView* surroundings_;
};

}  // namespace backwash::study
