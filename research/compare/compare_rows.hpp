// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "research/compare/compare_report.hpp"

namespace backwash::services {

/// What a part of a comparison found: a line of JSON for each pair, with what every method made of it, and one for a
/// flight campaign through the narrow gap (docs/interfaces.md, "backwash compare"). Without planning times: the same
/// bytes wherever and whenever it runs. `first`: number of the scene's first pair here.
std::string to_rows(const report::Comparison& comparison, std::size_t first);

/// Adds the scenes and gaps of such lines to `comparison`, whose methods and `flights` are set: scenes in the order of
/// the lines, pairs in theirs. Throws Failure: 66, or 65 with file and line for what is no row, a pair that is missing
/// or out of order, and a scene without `flights` of them.
void add_rows(report::Comparison& comparison, const std::string& path);

/// Calls `each(name, member)` for the numbers that are kept of a flown plan, in their order: rows and CSV go through
/// these. `outcome`: a sim::RouteOutcome, const or not.
void each_kept(auto& outcome, const auto& each) {
  each("length_m", outcome.planned.length_m);
  each("time_s", outcome.planned.time_s);
  each("jerk2", outcome.planned.jerk2);
  each("flown_m", outcome.flown_m);
  each("flown_jerk2", outcome.flown_jerk2);
  each("energy_J", outcome.energy_J);
  each("clearance_m", outcome.clearance_m);
  each("samples", outcome.samples);
  each("contact_samples", outcome.contacts);
  each("samples_outside", outcome.outside);
}

}  // namespace backwash::services
