// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/study/inference/search.hpp"
#include "tests/study_worlds/score.hpp"

namespace study_worlds {

/// The estimated parameters of which the generator knows the value in the same unit (drag at
/// 1 m/s, a map offset as the map file shows it); empty for a cause without one.
std::vector<Compared> compare(const HiddenWorld& world, const std::vector<Table>& flights,
                              const backwash::study::Accepted& found);
/// Share of a channel's variance between windows that the hidden effect's window means explain, largest of all
/// channels.
double explained(const backwash::study::Observations& seen, const std::vector<Table>& flights);

/// |value − truth|/|truth| over all of them as one vector.
std::optional<double> parameter_error(const std::vector<Compared>& compared);

/// Compares with an oracle's column, the hidden effect's own value averaged over each window: sets `gain_share`, the
/// held-out gain of the found cause over that of the oracle with one factor fitted, and of each compared parameter
/// `best`, where the estimate is of one shape alone (Form::shapes). Leaves them empty for effects that are neither a
/// push nor a factor on the variance.
void compare_with_oracle(WorldOutcome& outcome, const backwash::study::Accepted& found,
                         const backwash::study::Observations& seen, const std::vector<Table>& flights);

}  // namespace study_worlds
