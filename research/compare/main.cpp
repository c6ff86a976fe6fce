// SPDX-License-Identifier: BSD-3-Clause
#include "research/compare/compare_verb.hpp"
#include "services/backwash/tool.hpp"

/// `backwash compare`, which runs this program.
int main(int argc, char** argv) { return backwash::services::run_tool(argc, argv, {backwash::services::compare_verb}); }
