// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/columns.hpp"

namespace backwash::study {

/// One rotor gives less for the same command, and may shake.
Effect propeller_damage() {
  return {.name = "propeller_damage",
          .forms = {{.formula = "one rotor needs (1 + d) of the others' thrust command",
                     .parameters = {"d"},
                     .scale_name = "rotor",
                     .scales = rotors(),
                     .integer_scale = true,
                     .motors_alone = true,
                     .constant = true,
                     .least = 0.04,
                     .one_sided = true,
                     .needs = {Source::motors},
                     .columns = [](const Windows& ws,
                                   const Scale& rotor) { return std::vector{one_rotor(kMotor1, ws, rotor, true)}; }},
                    {.formula = "one rotor needs (1 + d) of the others' thrust command and shakes at its rate",
                     .parameters = {"d", "P_ln"},
                     .scale_name = "rotor",
                     .scales = rotors(),
                     .integer_scale = true,
                     .constant = true,
                     .least = 0.04,
                     .one_sided = true,
                     .needs = {Source::rpm, Source::motors},
                     .columns = [](const Windows& ws, const Scale& rotor) {
                       return std::vector{one_rotor(kMotor1, ws, rotor, true), one_rotor(kLine1, ws, rotor, false)};
                     }}}};
}

}  // namespace backwash::study
