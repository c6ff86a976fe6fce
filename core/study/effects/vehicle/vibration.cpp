// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "core/study/effects/columns.hpp"
#include "core/study/effects/effect_rules.hpp"
#include "core/study/effects/on_the_model.hpp"
#include "core/study/windows/signals/signals.hpp"
#include "core/types/text.hpp"

namespace backwash::study {
namespace {

/// Lines that sampling folds to where the gusts and the loop are, or next to half the rate, cannot be told.
std::optional<std::string> folded_away(const Observations& seen) {
  double lines = 0;
  for (std::size_t rotor = 0; rotor < 4; ++rotor)
    for (const double w : seen.weight[kLine1 + rotor]) lines += w > 0 ? 1 : 0;
  const double all = 4 * static_cast<double>(seen.windows.size());
  if (lines >= kEffectRules.line_share * all) return std::nullopt;
  return "sampled once in " + std::to_string(std::lround(1000 * seen.row_period)) +
         " ms the rotors' lines fold below " + to_text(kWindowRules.least_folded, 2) +
         " Hz, where gusts and loop are, or next to half the rate, in " +
         std::to_string(std::lround(100 * (1 - lines / all))) + " % of the windows";
}

}  // namespace

/// All rotors shake the craft at their own rates.
Effect vibration() {
  return {
      .name = "vibration",
      .forms = {{.formula = "ln power at all rotors' rates + P",
                 .parameters = {"P_ln"},
                 .priors = {{kPriors.typical_line, 0, HUGE_VAL, "a line stands over the noise"}},
                 .constant = true,
                 .floor = 0.25,
                 .one_sided = true,
                 .needs = {Source::rpm},
                 .not_flown = folded_away,
                 .columns =
                     [](const Windows& ws, const Scale&) {
                       DesignColumn c;
                       for (std::size_t rotor = 0; rotor < 4; ++rotor)
                         c.parts.push_back({static_cast<Channel>(kLine1 + rotor), std::vector<double>(ws.size(), 1.0)});
                       return std::vector{c};
                     },
                 .simulate = [](const FittedForm&,
                                const Observations& seen) { return std::vector{rotor_lines(seen)}; }}},
      .remedy = always(RemedyIn::craft,
                       "Balance the propellers, and look for loose motors and a worn damping of the autopilot.")};
}

}  // namespace backwash::study
