// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/columns.hpp"
#include "core/study/effects/on_the_model.hpp"

namespace backwash::study {

/// Rotors follow their commands later than the simulation's.
Effect actuator_lag() {
  return {
      .name = "actuator_lag",
      .forms = {{.formula = "thrust follows its command tau later",
                 .parameters = {"tau_s"},
                 .possible = {{0, 0.5, "a craft whose thrust lags by half a second does not hover"}},
                 .least = 0.01,
                 .one_sided = true,
                 .needs = {Source::attitude, Source::thrust, Source::setpoints},
                 .columns =
                     [](const Windows& ws, const Scale&) {
                       return std::vector{Column{{{kThrustDelay, values(ws, [](auto& w) { return w.delay_gain[0]; })},
                                                  {kThrustSlope, values(ws, [](auto& w) { return w.slope_gain[0]; })},
                                                  {kMeanZ, values(ws, [](auto& w) { return w.mean_gain[0]; })}}}};
                     },
                 .simulate = simulates(SimulationTerm::Kind::thrust_lag)}},
      .remedy =
          [](auto&, auto&) {
            return with_craft(
                "Look for heavier propellers or slower speed controllers than the simulation has; the model of --out "
                "has the lag.");
          },
      .manoeuvres = {{"thrust pulses: climb and sink with 2 m/s² in turn", [](WindowRow& w, double) {
                        w.delay_gain = {-60, 0}, w.slope_gain = {0, 14};
                      }}}};
}

}  // namespace backwash::study
