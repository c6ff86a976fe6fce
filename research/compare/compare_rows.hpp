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

}  // namespace backwash::services
