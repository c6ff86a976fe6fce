// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/columns.hpp"
#include "core/study/effects/effect_rules.hpp"
#include "core/study/effects/on_the_model.hpp"

namespace backwash::study {

/// The wash that comes back from the surface below lifts.
Effect ground_thrust() {
  return {
      .name = "ground_thrust",
      .forms = {{.formula = "z push A exp(-(h - 0.4 m)/L), h the height over the surface below",
                 .parameters = {"A_mps2"},
                 .priors = {{kPriors.typical_push}},
                 .reference =
                     Reference{kSurfaceReference, "m over the surface", [](auto& w) { return w.around.height; }},
                 .scale_name = "L_m",
                 .scales = scales_of({0.08, 0.15, 0.3, 0.6}),
                 .reach =
                     Reach{kEffectRules.farthest_wash, "z_m",
                           "a wash is felt within two or three diameters of a rotor; farther it is a slope by height"},
                 .by_place = true,
                 .floor = 0.02,
                 .columns =
                     lifts([](auto& at, double length) { return near_surface(at.height, kSurfaceReference, length); }),
                 .shapes = {{.formula = "z push A (0.4 m/h)^n",
                             .parameters = {},
                             .scale_name = "n",
                             .scales = scales_of({1.0, 3.0}),
                             .columns = lifts([](auto& at, double n) {
                               return power_of_distance(at.height, kSurfaceReference, n);
                             })}},
                 .extend = extends(Law::push_over_surface),
                 .simulate = simulates(Law::push_over_surface)}},
      .axis = {"height over the surface, m", false, [](auto& w) { return w.around.height; }},
      .manoeuvres = {{"hover at three heights, 0.3, 0.8 and 1.3 m over the floor, away from walls and ceiling",
                      [](WindowRow& w, double s) {
                        w.around = {{0.3 + 0.5 * std::floor(2.999 * s), 2.0, {}}};
                        w.p_W.z() = w.around.height;
                      }}}};
}

}  // namespace backwash::study
