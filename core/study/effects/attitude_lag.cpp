// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "core/study/effects/columns.hpp"
#include "core/study/effects/on_the_model.hpp"

namespace backwash::study {

/// The attitude follows what the controller asks of it later than the vehicle file says: with set-points, and with
/// gusts that the loop answers. Late set-points (command_latency) leave the answer to gusts as it is.
Effect attitude_lag() {
  return {
      .name = "attitude_lag",
      .forms = {{.formula = "the attitude lags this much longer, level axes",
                 .parameters = {"lag_s"},
                 .possible = {{-0.3, 0.5, "a craft whose attitude lags by half a second does not hover"}},
                 .constant = true,
                 .least = 0.01,
                 .needs = {Source::setpoints},
                 .unknowable = [](const Observations& seen) { return seen.row_period / 4; },
                 .columns =
                     [](const Windows& ws, const Scale&) {
                       return std::vector{Column{{{kCommandDelayH, values(ws, [](auto& w) { return w.lag_gain[0]; })},
                                                  {kTiltDelay, values(ws, [](auto& w) { return w.tilt_gain; })}}}};
                     },
                 .simulate = simulates(SimulationTerm::Kind::attitude_lag)}},
      .remedy =
          [](auto& fitted, auto& v) {
            const double now = v.controller.attitude_lag;
            return in_vehicle({{"controller.attitude_lag", now, std::max(0.0, now + fitted.theta[0])}});
          },
      .manoeuvres = {{"hover in gusts, attitude logged", [](WindowRow& w, double) { w.tilt_gain = 10; }}}};
}

}  // namespace backwash::study
