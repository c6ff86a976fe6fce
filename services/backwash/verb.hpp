// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/types/geometry.hpp"
#include "core/types/text.hpp"

namespace backwash::services {

/// Exit codes of the program: sysexits.h, and 1 for a flight that was flown and failed.
enum ExitCode {
  kOk = 0,
  kFlightFailed = 1,
  kUsage = 64,
  kBadData = 65,
  kNoInput = 66,
  kUnavailable = 69,  ///< no plan, or a start or goal that cannot be used
  kInternal = 70,
  kCannotCreate = 73,
  kInputOutput = 74,
  kConfiguration = 78,
};

/// Ends a verb: main() prints `backwash VERB: what()` on stderr and exits with the code.
struct Failure : std::runtime_error {
  Failure(int code, const std::string& line) : std::runtime_error(line), exit_code(code) {}
  int exit_code;
};

/// A subcommand and what it does once its options are parsed; `run` returns the exit code.
struct Verb {
  CLI::App* command;
  std::function<int()> run;
};

Verb fly_verb(CLI::App& app);
Verb field_verb(CLI::App& app);
Verb reach_verb(CLI::App& app);
Verb plan_verb(CLI::App& app);
Verb simulate_verb(CLI::App& app);
Verb feasibility_verb(CLI::App& app);
Verb compare_verb(CLI::App& app);
Verb report_verb(CLI::App& app);
Verb calibrate_verb(CLI::App& app);
Verb import_verb(CLI::App& app);
Verb replay_verb(CLI::App& app);
Verb study_verb(CLI::App& app);
Verb vehicle_verb(CLI::App& app);

/// Adds an option that takes `x,y,z` in m (W); anything else is a usage error.
CLI::Option* add_point(CLI::App& command, const std::string& name, std::optional<Vec3>& target,
                       const std::string& help);

/// Adds an option that takes one of some names, each of which stands for a value; anything else is a usage error.
template <typename Target, typename Value>
CLI::Option* add_choice(CLI::App& command, const std::string& name, Target& target,
                        const std::vector<std::pair<std::string, Value>>& choices, const std::string& help) {
  std::vector<std::string> names;
  for (const auto& choice : choices) names.push_back(choice.first);
  const auto take = [&target, choices](const std::string& said) {
    for (const auto& [known, value] : choices)
      if (known == said) target = value;
  };
  return command.add_option_function<std::string>(name, take, help)->check(CLI::IsMember(names));
}

/// A line on stderr if that is a terminal, nothing otherwise.
void progress(const std::string& line);

}  // namespace backwash::services
