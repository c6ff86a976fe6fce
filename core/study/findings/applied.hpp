// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "core/study/inference/search.hpp"

namespace backwash::study {

/// What the extension by a cause does to flights that it was not fitted to. Everything that will be applied is applied
/// and nothing else: θ and the coefficients of the companions, both fitted without the flight, and no free offset. The
/// level of Σ stays free: it is calibrate's.
struct Applied {
  std::vector<double> beside;                      ///< coefficients of the form's companions, fitted to all flights
  double nats = 0;                                 ///< held out
  double coverage_before = 0, coverage_after = 0;  ///< share of samples in the model's central 90 % interval
  std::string refused;                             ///< why it does not join the model; empty: it does
};

/// One for each accepted cause. Refused is, the worst first and the others judged anew without it, a cause with which
/// flights that were not fitted are less likely, or of whose samples fewer lie in the central 90 % interval, fewer than
/// 90 % that is. `refused`: why each is refused before that, and the others judged without it; empty: none is.
std::vector<Applied> judge(const Evidence& evidence, const std::vector<Accepted>& accepted,
                           const std::vector<std::string>& refused);

}  // namespace backwash::study
