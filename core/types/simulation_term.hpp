// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <variant>
#include <vector>

#include "core/types/law.hpp"

namespace backwash {

/// What an accepted cause of the study adds to the simulation: an entry of [[extension.term]].simulation of a model
/// file (docs/model.md 6-10 to 6-17): a law of the air, or what the simulation alone knows. Field, reach and plan read
/// ModelEffect instead: a plan does not know battery, time or sensor.
struct SimulationTerm {
  enum class Kind {
    // The air.
    push_of_heading,        ///< x, y of the body's heading, m/s²
    ln_variance_with_time,  ///< B, τ s: ln Σ + B (1 − e^{−t/τ}), t since the flight's start
    variance_elsewhere,     ///< share, x, y m: ln Σ by that share as it is at the place moved by (x, y)
    kurtosis,               ///< K: bursts that raise ln kurtosis by K and leave Σ as it is
    // Thrust and commands.
    thrust_share,         ///< m: thrust per mass times (1 − m)
    thrust_slope,         ///< s: a change of the thrust about hover is worth (1 + s) of it
    thrust_with_voltage,  ///< s, V* V, V_m V, V_0 V, r V/s: thrust (1 − s (V* − V)/V_m); V_0 + r t where no log tells V
    thrust_lag,           ///< τ s: thrust follows its command with a first-order lag
    setpoint_delay,       ///< τ s: set-points act later by this
    attitude_lag,         ///< τ s: the attitude follows its command with a lag that is longer by this
    // Sensors and rotors.
    sensor_drift_with_time,  ///< x, y, z m/s² per 100 s, and at t = 0: bias of the accelerometer along the heading's
                             ///< axes
    sensor_drift_with_temperature,  ///< x, y, z m/s² per 10 °C, at 25 °C x, y, z, T_0 °C, r °C/s: as V for the battery
    sensor_lines,  ///< rotors 1 … 4 m/s², floor m/s²: amplitudes along z at the rotors' rates, over noise of this size
    rotor_needs,    ///< rotors 1 … 4: ln of the thrust command that each needs, over the others'
    rotor_reading,  ///< rotors 1 … 4: ln of rpm² as it is read over what it is
    rotor_dropout,  ///< rotors 1 … 4: share of rpm readings that are missing
  };
  std::variant<Law, Kind> kind = Law::push;
  std::vector<double> value;  ///< of a law: its values, and its scale if it has one

  bool is(Kind k) const noexcept { return kind == std::variant<Law, Kind>(k); }
};

}  // namespace backwash
