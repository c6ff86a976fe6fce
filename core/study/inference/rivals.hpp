// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/study/inference/search.hpp"

namespace backwash::study {

/// Everything accepted but one, with what it leaves open, as columns.
std::vector<Column> columns_of(const std::vector<Accepted>& accepted, const Observations& seen,
                               std::size_t but = SIZE_MAX);

/// Whether a cause is a delay or a slope, told by the moments of what is commanded.
bool dynamic(const std::vector<Column>& columns);

bool share_a_channel(const std::vector<Column>& a, const std::vector<Column>& b);

/// Whether a cause of this gain beside the accepted ones is what the error of the form of one of them looks like: it
/// lost more than half of its gain to that one, and what is left is little beside it. `itself`: its own number.
bool error_of_form(const Form& form, const std::vector<Column>& columns, double gain,
                   const std::vector<Accepted>& accepted, const Evidence& evidence, std::size_t itself = SIZE_MAX);

/// Adds to an accepted cause those of the catalogue that these flights do not tell from it. `threshold`: nats that a
/// rival gains itself, or half of the cause's gain.
void find_rivals(const Evidence& evidence, std::vector<Accepted>& accepted, std::size_t which, double threshold);

}  // namespace backwash::study
