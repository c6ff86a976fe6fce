// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/study/inference/search.hpp"

namespace backwash::study {

/// Everything accepted but one, with what it leaves open, as columns.
std::vector<DesignColumn> columns_of(const std::vector<Accepted>& accepted, const Observations& seen,
                                     std::size_t but = SIZE_MAX);

/// Whether a cause is a delay or a slope, told by the moments of what is commanded.
bool dynamic(const std::vector<DesignColumn>& columns);

bool share_a_channel(const std::vector<DesignColumn>& a, const std::vector<DesignColumn>& b);

/// Nats by which one set of columns leads another over the flights, and the standard error of that sum.
struct Lead {
  double nats, error;
};
Lead lead_over(const NormalEquations& ours, const NormalEquations& theirs);

/// The lead, nats, above which a rival is told from a cause. `error`: the lead's; `gain`: the cause's where one of the
/// two is a delay or a slope, else 0: there a lead that is a small share of the gain is one that the error of a form
/// makes.
double needed_lead(double error, double gain);

/// Adds to an accepted cause those of the catalogue that these flights do not tell from it. `threshold`: nats that a
/// rival gains itself, or half of the cause's gain.
void find_rivals(const Evidence& evidence, std::vector<Accepted>& accepted, std::size_t which, double threshold);

}  // namespace backwash::study
