// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "services/backwash/verb.hpp"

namespace backwash::services {

/// A program of verbs: reads the line, runs its verb, and says on stderr what went wrong. Returns the exit code.
int run_tool(int argc, char** argv, const std::vector<Verb (*)(Command&)>& verbs);

}  // namespace backwash::services
