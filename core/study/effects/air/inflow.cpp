// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/columns.hpp"
#include "core/study/effects/on_the_model.hpp"

namespace backwash::study {

/// A climb brings the rotors more inflow and less thrust for the same command; a descent the other way round.
Effect inflow() {
  return {.name = "inflow",
          .forms = {{.formula = "z push -k v_z",
                     .parameters = {"k_per_s"},
                     .priors = {{kPriors.typical_rate, 0, HUGE_VAL, "a climb takes thrust"}},
                     .floor = 0.01,
                     .one_sided = true,
                     .needs = {Source::attitude, Source::thrust},  // a loop that is late looks like it
                     .columns =
                         [](const Windows& ws, const Scale&) {
                           return std::vector{lifting(
                               ws, [](auto& w, std::size_t k) { return -w.climbs[k]; },
                               [](auto& w) { return -w.v_W.z(); })};
                         },
                     .extend = unknown_push,
                     .simulate = simulates(Law::push_against_climb)}},
          .axis = {"climb, m/s", false, [](auto& w) { return w.v_W.z(); }},
          .manoeuvres = {
              {"climb and sink at one speed through the same heights, away from walls", [](WindowRow& w, double s) {
                 w.speed = 0.7;
                 w.speeds.fill(w.speed);
                 w.v_W = Vec3(0, 0, std::fmod(8 * s, 2.0) < 1 ? 0.7 : -0.7);
               }}}};
}

}  // namespace backwash::study
