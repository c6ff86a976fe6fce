// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/columns.hpp"
#include "core/study/effects/on_the_model.hpp"

namespace backwash::study {

/// All rotors shake the craft at their own rates.
Effect vibration() {
  return {
      .name = "vibration",
      .forms = {
          {.formula = "ln power at all rotors' rates + P",
           .parameters = {"P_ln"},
           .constant = true,
           .floor = 0.25,
           .one_sided = true,
           .needs = {Source::rpm},
           .columns =
               [](const Windows& ws, const Scale&) {
                 Column c;
                 for (std::size_t rotor = 0; rotor < 4; ++rotor)
                   c.parts.push_back({static_cast<Channel>(kLine1 + rotor), std::vector<double>(ws.size(), 1.0)});
                 return std::vector{c};
               },
           .simulate = [](const FittedForm&, const Observations& seen) { return std::vector{rotor_lines(seen)}; }}}};
}

}  // namespace backwash::study
