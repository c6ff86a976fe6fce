// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/columns.hpp"

namespace backwash::study {
namespace {

auto of_one_rotor(SimulationTerm::Kind kind) {
  return [kind](const FittedForm& fitted, const Observations&) {
    SimulationTerm term{kind, std::vector<double>(4, 0)};
    term.value[static_cast<std::size_t>(fitted.scale.value)] = fitted.theta[0];
    return std::vector{term};
  };
}

}  // namespace

/// One rotor's rpm reading is wrong, or fails now and then.
Effect rotor_sensor_fault() {
  return {.name = "rotor_sensor_fault",
          .at_rotors = AtRotors::sensor,
          .forms = {{.formula = "one rotor's rpm^2 reads (1 + e) of what its command gives",
                     .parameters = {"e"},
                     .priors = {{kPriors.typical_share}},
                     .scale_name = "rotor",
                     .scales = rotors(),
                     .integer_scale = true,
                     .constant = true,
                     .least = 0.06,
                     .needs = {Source::rpm},
                     .columns = [](const Windows& ws,
                                   const Scale& rotor) { return std::vector{one_rotor(kRpm1, ws, rotor, true)}; },
                     .simulate = of_one_rotor(SimulationTerm::Kind::rotor_reading),
                     .meanings = {share_of_ln}},
                    {.formula = "a share of one rotor's rpm readings is stuck or missing",
                     .parameters = {"share"},
                     .priors = {{kPriors.typical_share, 0, 1, "a share of the readings"}},
                     .scale_name = "rotor",
                     .scales = rotors(),
                     .integer_scale = true,
                     .constant = true,
                     .least = 0.01,
                     .one_sided = true,
                     .needs = {Source::rpm},
                     .columns = [](const Windows& ws,
                                   const Scale& rotor) { return std::vector{one_rotor(kDropout1, ws, rotor, false)}; },
                     .simulate = of_one_rotor(SimulationTerm::Kind::rotor_dropout)}},
          .remedy = [](auto& fitted, auto&) {
            return with_craft("Look at the rpm sensor of " + rotor_of(fitted) +
                              ": its gap, its wire, its number of poles.");
          }};
}

}  // namespace backwash::study
