// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/columns.hpp"
#include "core/study/effects/effect_rules.hpp"
#include "core/study/effects/on_the_model.hpp"
#include "core/types/text.hpp"

namespace backwash::study {
namespace {

std::optional<std::string> not_under_one(const Observations& seen) {
  if (any(seen, [](auto& w) { return w.around.ceiling_gap < kEffectRules.under_ceiling; })) return std::nullopt;
  return "no ceiling within " + to_text(kEffectRules.under_ceiling, 1) + " m of the flights";
}

double near_ceiling(double gap, double length) { return near_surface(gap, kCeilingReference, length); }

const Reference under = {kCeilingReference, "m under the surface", [](auto& w) { return w.around.ceiling_gap; }};

Reach wash() {
  return {kEffectRules.farthest_wash, "ceiling_gap_m",
          "a wash is felt within two or three diameters of a rotor; farther it is a slope by height"};
}

Form pull() {
  return {.formula = "z push A exp(-(d - 0.3 m)/L), d the gap to the surface above",
          .parameters = {"A_mps2"},
          .priors = {{kPriors.typical_push, 0, HUGE_VAL, "a surface above pulls upward"}},
          .reference = under,
          .scale_name = "L_m",
          .scales = scales_of({0.08, 0.15, 0.3, 0.6}),
          .reach = wash(),
          .by_place = true,
          .floor = 0.02,
          .needs = {Source::ceiling},
          .not_flown = not_under_one,
          .columns = lifts([](auto& at, double length) { return near_ceiling(at.ceiling_gap, length); }),
          .shapes = {{.formula = "z push A (0.3 m/d)^n",
                      .parameters = {},
                      .scale_name = "n",
                      .scales = scales_of({1.0, 3.0}),
                      .columns = lifts(
                          [](auto& at, double n) { return power_of_distance(at.ceiling_gap, kCeilingReference, n); })}},
          .extend = extends(Law::push_under_surface),
          .simulate = simulates(Law::push_under_surface)};
}

Form gusts() {
  return {.formula = "ln variance + B exp(-(d - 0.3 m)/L), d the gap to the surface above",
          .parameters = {"B_ln"},
          .priors = {{kPriors.typical_ln}},
          .reference = under,
          .scale_name = "L_m",
          .scales = scales_of({0.15, 0.3, 0.6}),
          .reach = wash(),
          .floor = 0.12,
          .needs = {Source::ceiling},
          .not_flown = not_under_one,
          .columns = scatters([](auto& w, auto& length) {
            return along(w, [&](auto& at) { return near_ceiling(at.ceiling_gap, length.value); });
          }),
          .extend = extends(Law::ln_variance_under_surface),
          .simulate = simulates(Law::ln_variance_under_surface)};
}

}  // namespace

/// A surface above pulls, and makes the wash gustier.
Effect ceiling() {
  return {.name = "ceiling",
          .forms = {pull(), gusts()},
          .axis = {"gap to the ceiling, m", false, [](auto& w) { return w.around.ceiling_gap; }},
          .manoeuvres = {{"hover 0.25, 0.5 and 1 m below the ceiling, high above the floor",
                          [](WindowRow& w, double s) {
                            w.around = {{2.0, 0.25 * std::pow(2, std::floor(2.999 * s)), {}}};
                          }},
                         {"a spot without ceiling, then the same height under one",
                          [](WindowRow& w, double s) { w.around.ceiling_gap = s < 0.5 ? kNoSurface : 0.3; }}}};
}

}  // namespace backwash::study
