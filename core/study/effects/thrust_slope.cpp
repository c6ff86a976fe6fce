// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/columns.hpp"
#include "core/study/effects/on_the_model.hpp"

namespace backwash::study {

/// The thrust curve is steeper or shallower at hover than modelled.
Effect thrust_slope() {
  return {.name = "thrust_slope",
          .forms = {{.formula = "a change of the thrust command is worth (1 + s) of the modelled",
                     .parameters = {"s"},
                     .constant = true,
                     .least = 0.03,
                     .needs = {Source::attitude, Source::thrust, Source::setpoints},
                     .columns =
                         [](const Windows& ws, const Scale&) {
                           return std::vector{
                               Column{{{kThrustDelay, values(ws, [](auto& w) { return w.delay_gain[1]; })},
                                       {kThrustSlope, values(ws, [](auto& w) { return w.slope_gain[1]; })}}}};
                         },
                     .simulate = simulates(SimulationTerm::Kind::thrust_slope)}}};
}

}  // namespace backwash::study
