// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/types/geometry.hpp"
#include "core/types/text.hpp"
#include "services/backwash/progress.hpp"
#include "services/command_line/command_line.hpp"
#include "services/command_line/exit_code.hpp"

namespace backwash::services {

/// Ends a verb: main() prints `backwash VERB: what()` on stderr and exits with the code.
struct Failure : std::runtime_error {
  Failure(ExitCode code, const std::string& line) : std::runtime_error(line), exit_code(code) {}
  ExitCode exit_code;
};

/// A subcommand and what it does once its options are parsed; `run` returns the exit code.
struct Verb {
  Command* command;
  std::function<int()> run;
};

Verb fly_verb(Command& app);
Verb field_verb(Command& app);
Verb reach_verb(Command& app);
Verb plan_verb(Command& app);
Verb simulate_verb(Command& app);
Verb report_verb(Command& app);
Verb calibrate_verb(Command& app);
Verb import_verb(Command& app);
Verb replay_verb(Command& app);
Verb export_verb(Command& app);
Verb merge_verb(Command& app);
Verb study_verb(Command& app);
Verb adapt_verb(Command& app);
Verb vehicle_verb(Command& app);
Verb map_verb(Command& app);
Verb campaign_verb(Command& app);
Verb keys_verb(Command& app);

/// So many finite numbers with commas between them; anything else is a usage error that says what they `are`.
std::vector<double> read_numbers(const std::string& option, const std::string& text, std::size_t count,
                                 const std::string& are);
/// Adds an option that takes `x,y,z` in m (W); anything else is a usage error.
Option add_point(Command& command, const std::string& name, std::optional<Vec3>& target, const std::string& help);

}  // namespace backwash::services
