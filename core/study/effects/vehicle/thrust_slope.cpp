// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "core/study/effects/columns.hpp"
#include "core/study/effects/on_the_model.hpp"
#include "core/types/formatted.hpp"
#include "core/types/thrust.hpp"

namespace backwash::study {

namespace {

/// max_thrust and thr_mdl_fac with the same thrust at the hover's command, and a slope there (1 + s) times as large.
Remedy steeper(const FittedForm& fitted, const Vehicle& v) {
  const double f = v.propulsion.thr_mdl_fac, weight = v.body.mass * kGravity, share = weight / v.propulsion.max_thrust;
  const double u = thrust_command(v, share);
  const double per_thrust = (1 + fitted.theta[0]) * (2 * f * u + 1 - f) / share;  // slope over thrust at u
  const double wanted = std::clamp((per_thrust * u - 1) / (2 * u - 1 - per_thrust * (u * u - u)), 0.0, 1.0);
  return in_vehicle(
      {{"propulsion.thr_mdl_fac", f, wanted},
       {"propulsion.max_thrust", v.propulsion.max_thrust, weight / (wanted * u * u + (1 - wanted) * u)}},
      formatted("Thrust rises %.3g times as steeply with its command as the file says", 1 + fitted.theta[0]));
}

}  // namespace

/// The thrust curve is steeper or shallower at hover than modelled.
Effect thrust_slope() {
  return {.name = "thrust_slope",
          .forms = {{.formula = "a change of the thrust command is worth (1 + s) of the modelled",
                     .parameters = {"s"},
                     .priors = {{kPriors.typical_slope, -1, HUGE_VAL, "more command is no less thrust"}},
                     .least = 0.03,
                     .needs = {Source::attitude, Source::thrust, Source::setpoints},
                     .columns =
                         [](const Windows& ws, const Scale&) {
                           return std::vector{
                               DesignColumn{{{kThrustDelay, values(ws, [](auto& w) { return w.delay_gain[1]; })},
                                             {kThrustSlope, values(ws, [](auto& w) { return w.slope_gain[1]; })},
                                             {kMeanZ, values(ws, [](auto& w) { return w.mean_gain[1]; })}}}};
                         },
                     .simulate = simulates(SimulationTerm::Kind::thrust_slope)}},
          .remedy = steeper};
}

}  // namespace backwash::study
