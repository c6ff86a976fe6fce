// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "research/compare/compare_report.hpp"
#include "services/backwash/json.hpp"

namespace backwash::services {

/// What `compare` prints with --json (docs/interfaces.md, "backwash compare").
Json to_json(const report::Comparison& comparison);
/// The same as a table for people.
void print_text(const report::Comparison& comparison);
/// One line a pair and method (docs/interfaces.md, "backwash compare").
std::string to_csv(const report::Comparison& comparison);

}  // namespace backwash::services
