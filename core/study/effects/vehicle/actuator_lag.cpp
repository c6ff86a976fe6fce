// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "core/study/effects/columns.hpp"
#include "core/study/effects/on_the_model.hpp"
#include "core/types/formatted.hpp"

namespace backwash::study {
namespace {

Form of_thrust() {
  return {.formula = "thrust follows its command tau later",
          .parameters = {"tau_s"},
          .priors = {{kPriors.typical_delay, 0, HUGE_VAL, "rotors do not foresee their commands"}},
          .least = 0.01,
          .one_sided = true,
          .needs = {Source::attitude, Source::thrust, Source::setpoints},
          .columns =
              [](const Windows& ws, const Scale&) {
                return std::vector{DesignColumn{{{kThrustDelay, values(ws, [](auto& w) { return w.delay_gain[0]; })},
                                                 {kThrustSlope, values(ws, [](auto& w) { return w.slope_gain[0]; })},
                                                 {kMeanZ, values(ws, [](auto& w) { return w.mean_gain[0]; })}}}};
              },
          .simulate = simulates(SimulationTerm::Kind::thrust_lag)};
}

/// With set-points, and with gusts that the loop answers: late set-points (command_latency) leave the answer to gusts
/// as it is.
Form of_attitude() {
  return {.formula = "the attitude lags this much longer, level axes",
          .parameters = {"lag_s"},
          .priors = {{kPriors.typical_delay}},
          .constant = true,
          .least = 0.01,
          .needs = {Source::setpoints},
          .unknowable = [](const Observations& seen) { return seen.row_period / 4; },
          .columns =
              [](const Windows& ws, const Scale&) {
                return std::vector{DesignColumn{{{kCommandDelayH, values(ws, [](auto& w) { return w.lag_gain[0]; })},
                                                 {kTiltDelay, values(ws, [](auto& w) { return w.tilt_gain; })}}}};
              },
          .simulate = simulates(SimulationTerm::Kind::attitude_lag)};
}

Remedy of_either(const FittedForm& fitted, const Vehicle& v) {
  if (fitted.form.parameters.front() != "lag_s")
    return with_craft(
        "Look for heavier propellers or slower speed controllers than the simulation has; the model of --out has the "
        "lag.");
  const double now = v.controller.attitude_lag;
  const double lags = now + fitted.theta[0];
  if (lags < 0)
    return with_craft(
        "The attitude answers before its set-point: look whether the log holds attitude and the set-points' "
        "accelerations.");
  return in_vehicle({{"controller.attitude_lag", now, lags}},
                    formatted("The attitude lags %.3g s, not %.3g", lags, now));
}

}  // namespace

/// Rotors follow their commands later than the simulation's: together in the thrust, against each other in the
/// attitude.
Effect actuator_lag() {
  return {.name = "actuator_lag",
          .forms = {of_thrust(), of_attitude()},
          .remedy = of_either,
          .manoeuvres = {{"thrust pulses: climb and sink with 2 m/s² in turn",
                          [](WindowRow& w, double) {
                            w.delay_gain = {-60, 0};
                            w.slope_gain = {0, 14};
                          }},
                         {"hover in gusts, attitude logged", [](WindowRow& w, double) { w.tilt_gain = 10; }}}};
}

}  // namespace backwash::study
