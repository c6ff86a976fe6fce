// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "core/study/effects/columns.hpp"
#include "core/study/effects/on_the_model.hpp"

namespace backwash::study {
namespace {

std::optional<std::string> not_indoors(const Observations& seen) {
  if (!seen.has(Source::map) || any(seen, [](auto& w) { return std::isfinite(w.around.ceiling_gap); }))
    return std::nullopt;
  return "the map shows no closed room";
}

/// The most that was flown: a plan does not know how long the rotors have been running.
std::vector<ModelEffect> largest(const FittedForm& fitted, const Observations& seen) {
  const auto ln = added(fitted, seen, kVarZ);
  const double most = std::max(0.0, *std::max_element(ln.begin(), ln.end()));
  const Estimate& e = fitted.parameters.front();
  const double share = std::abs(e.value) > 0 ? half_width(e) / std::abs(e.value) : 0;
  return {{Law::ln_variance, Vec3(most, 0, 0), Vec3(most * share, 0, 0), 0}};
}

}  // namespace

/// The air of a closed room takes up the wash, and its gusts grow with the time of flight.
Effect recirculation() {
  return {.name = "recirculation",
          .forms = {{.formula = "ln variance + B (1 - exp(-t/tau)), t since the flight's start",
                     .parameters = {"B_ln"},
                     .priors = {{kPriors.typical_ln}},
                     .scale_name = "tau_s",
                     .scales = scales_of({8, 20, 50}),
                     .floor = 0.12,
                     .not_flown = not_indoors,
                     .columns = scatters([](auto& w, auto& tau) { return 1 - std::exp(-w.t / tau.value); }),
                     .shapes = {{.formula = "ln variance + B t^2/(t^2 + tau^2): the wash first has to come round",
                                 .parameters = {},
                                 .scale_name = "tau_s",
                                 .scales = scales_of({8, 20, 50}),
                                 .columns = scatters([](auto& w, auto& tau) {
                                   return w.t * w.t / (w.t * w.t + tau.value * tau.value);
                                 })}},
                     .extend = largest,
                     .simulate = simulates(SimulationTerm::Kind::ln_variance_with_time)}},
          .manoeuvres = {{"hover for five minutes in one spot, motors never stopped",
                          [](WindowRow& w, double s) { w.t = 300 * s; }}}};
}

}  // namespace backwash::study
