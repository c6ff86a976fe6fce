// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "core/study/compare_report.hpp"
#include "services/backwash/json.hpp"

namespace backwash::services {

/// What `compare` prints with --json (README.md, "compare").
Json to_json(const study::Comparison& comparison);
/// The same as a table for people.
void print_text(const study::Comparison& comparison);
/// One line a pair and method (README.md, "compare").
std::string to_csv(const study::Comparison& comparison);

}  // namespace backwash::services
