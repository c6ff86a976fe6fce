// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <filesystem>
#include <string_view>

#include "services/backwash/tool.hpp"

namespace {

using namespace backwash::services;

/// A program of the source tree beside this one, which packages do not hold (research/compare).
std::string compare_program() {
  return (std::filesystem::read_symlink("/proc/self/exe").parent_path() / "backwash-compare").string();
}

/// What is left of the verb where that program is not there.
Verb compare_verb(Command& app) {
  auto& command = app.add_subcommand(
      "compare", "The paper's Table I: sets against constant margins, flown in closed loop (source tree alone)");
  return {&command, []() -> int {
            throw Failure(backwash::kUnavailable,
                          compare_program() +
                              ":1: is not there; build the source tree (./fly), and run the backwash "
                              "of its build/release/services");
          }};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "compare") {
    ::execv(compare_program().c_str(), argv);
    if (argc < 3 || std::string_view(argv[2]) != "--help") argc = 2;  // its options are that program's
  }
  return run_tool(argc, argv,
                  {fly_verb, plan_verb, reach_verb, field_verb, simulate_verb, feasibility_verb, compare_verb,
                   report_verb, calibrate_verb, import_verb, replay_verb, export_verb, merge_verb, study_verb,
                   adapt_verb, vehicle_verb, map_verb, campaign_verb, keys_verb});
}
