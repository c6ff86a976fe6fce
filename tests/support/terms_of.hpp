// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/study/findings/extend.hpp"

namespace backwash::study {

/// Of the causes that join the model, what its file would hold.
inline std::vector<ExtensionTerm> terms_of(const StudyResult& result) {
  std::vector<ExtensionTerm> terms;
  for (const auto& cause : result.causes) {
    const auto& f = cause.found;
    if (!cause.applied.refused.empty()) continue;
    terms.push_back({f.form->cause(),
                     f.form->formula,
                     f.scale,
                     {f.theta.data(), f.theta.data() + f.theta.size()},
                     cause.applied.beside,
                     cause.gain.held_out_nats});
  }
  return terms;
}

}  // namespace backwash::study
