// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/columns.hpp"
#include "core/study/effects/on_the_model.hpp"
#include "core/types/formatted.hpp"

namespace backwash::study {

/// The controller acts on set-points later than the vehicle file says.
Effect command_latency() {
  return {.name = "command_latency",
          .forms = {{.formula = "set-points act later by this, level axes",
                     .parameters = {"latency_s"},
                     .priors = {{kPriors.typical_delay}},
                     .constant = true,
                     .least = 0.015,
                     .needs = {Source::setpoints},
                     .unknowable = [](const Observations& seen) { return seen.row_period / 4; },
                     .columns = shows(kCommandDelayH, [](auto& w, auto&) { return w.command_gain[0]; }),
                     .simulate = simulates(SimulationTerm::Kind::setpoint_delay)}},
          .remedy =
              [](auto& fitted, auto& v) {
                const double now = v.controller.latency;
                const double acts = now + fitted.theta[0];
                if (acts < 0)
                  return with_craft(formatted(
                      "The craft answers %.3g s before its set-points: look at their stamps, at how often they are "
                      "logged, and whether their velocities and accelerations are.",
                      -acts));
                return in_vehicle({{"controller.latency", now, acts}},
                                  formatted("Set-points act %.3g s late, not %.3g", acts, now));
              },
          .manoeuvres = {{"sideways steps of the set-point, hard", [](WindowRow& w, double) {
                            w.command_gain = w.lag_gain = {60, -10};
                          }}}};
}

}  // namespace backwash::study
