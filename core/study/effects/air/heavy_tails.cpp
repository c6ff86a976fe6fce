// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/columns.hpp"
#include "core/study/effects/on_the_model.hpp"

namespace backwash::study {

/// Bursts: the gusts are larger now and then than a Gaussian's.
Effect heavy_tails() {
  return {
      .name = "heavy_tails",
      .forms = {{.formula = "ln kurtosis + K",
                 .parameters = {"K_ln"},
                 .priors = {{kPriors.typical_ln, 0, HUGE_VAL, "bursts raise the kurtosis"}},
                 .constant = true,
                 .floor = 0.15,
                 .one_sided = true,
                 .unknowable =
                     [](const Observations&) { return kWindowRules.scatter2 / 2; },  // what of the wander is within 1 s
                 .columns = shows(kTail, [](auto&, auto&) { return 1.0; }),
                 .simulate = simulates(SimulationTerm::Kind::kurtosis)}},
      .remedy = always(RemedyIn::model, "Raise bound.kappa of the model file: gusts come in bursts.")};
}

}  // namespace backwash::study
