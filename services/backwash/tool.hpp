// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "services/backwash/verb.hpp"

namespace backwash::services {

/// The verbs that need no other program.
std::vector<Verb (*)(Command&)> verbs_of_one_process();

/// What a verb answers with --json: `words` are its line, from the verb on. The answer also where the verb then fails,
/// a flight that touched something, say. Throws UsageError, Failure. Not for two threads at once.
std::string answer(const std::vector<std::string>& words);

/// A program of verbs: reads the line, runs its verb, and says on stderr what went wrong. Returns the exit code.
int run_tool(int argc, char** argv, const std::vector<Verb (*)(Command&)>& verbs);

}  // namespace backwash::services
