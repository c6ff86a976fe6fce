// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/columns.hpp"
#include "core/study/effects/on_the_model.hpp"

namespace backwash::study {
namespace {

std::vector<SimulationTerm> needs_more(const FittedForm& fitted, const Observations&) {
  SimulationTerm term{SimulationTerm::Kind::rotor_needs, std::vector<double>(4, 0)};
  term.value[static_cast<std::size_t>(fitted.scale.value)] = fitted.theta[0];
  return {term};
}

std::vector<SimulationTerm> needs_more_and_shakes(const FittedForm& fitted, const Observations& seen) {
  auto terms = needs_more(fitted, seen);
  auto lines = rotor_lines(seen);
  for (std::size_t i = 0; i < 4; ++i)
    if (i != static_cast<std::size_t>(fitted.scale.value)) lines.value[i] = 0;
  terms.push_back(lines);
  return terms;
}

/// A weak rotor takes up to d/4 of the collective thrust with it, and shakes the craft: no payload, no rougher air.
std::vector<DesignColumn> lost_thrust(const Windows& ws) {
  return {missing_thrust(ws, [](auto&) { return 1.0; }), in_variance(ws, [](auto&) { return 1.0; })};
}

}  // namespace

/// One rotor gives less for the same command, and may shake.
Effect propeller_damage() {
  return {.name = "propeller_damage",
          .at_rotors = AtRotors::propeller,
          .forms = {{.formula = "one rotor needs (1 + d) of the others' thrust command",
                     .parameters = {"d"},
                     .priors = {{kPriors.typical_share, 0, HUGE_VAL, "damage takes thrust"}},
                     .scale_name = "rotor",
                     .scales = rotors(),
                     .integer_scale = true,
                     .constant = true,
                     .least = 0.04,
                     .one_sided = true,
                     .needs = {Source::motors},
                     .columns = [](const Windows& ws,
                                   const Scale& rotor) { return std::vector{one_rotor(kMotor1, ws, rotor, true)}; },
                     .companions = lost_thrust,
                     .simulate = needs_more,
                     .meanings = {share_of_ln}},
                    {.formula = "one rotor needs (1 + d) of the others' thrust command and shakes at its rate",
                     .parameters = {"d", "P_ln"},
                     .priors = {{kPriors.typical_share, 0, HUGE_VAL, "damage takes thrust"}, {kPriors.typical_line}},
                     .scale_name = "rotor",
                     .scales = rotors(),
                     .integer_scale = true,
                     .constant = true,
                     .least = 0.04,
                     .one_sided = true,
                     .needs = {Source::rpm, Source::motors},
                     .columns =
                         [](const Windows& ws, const Scale& rotor) {
                           return std::vector{one_rotor(kMotor1, ws, rotor, true), one_rotor(kLine1, ws, rotor, false)};
                         },
                     .companions = lost_thrust,
                     .simulate = needs_more_and_shakes,
                     .meanings = {share_of_ln, as_fitted}}},
          .remedy = [](auto& fitted, auto&) {
            return with_craft("Replace or re-glue the propeller of " + rotor_of(fitted) + ".");
          }};
}

}  // namespace backwash::study
