// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <filesystem>
#include <string_view>

#include "services/backwash/tool.hpp"

namespace {

using namespace backwash::services;

/// A program of the source tree beside this one, which packages do not hold (research/).
std::string program(const std::string& verb) {
  return (std::filesystem::read_symlink("/proc/self/exe").parent_path() / ("backwash-" + verb)).string();
}

/// What is left of a verb where its program is not there.
Verb elsewhere(Command& app, const char* name, const char* about) {
  return {&app.add_subcommand(name, std::string(about) + " (source tree alone)"), [name]() -> int {
            throw Failure(backwash::kUnavailable,
                          program(name) +
                              ":1: is not there; build the source tree (cmake --build --preset release), and run the "
                              "backwash of its build/release/services");
          }};
}

Verb compare_verb(Command& app) {
  return elsewhere(app, "compare", "The paper's Table I: sets against constant margins, flown in closed loop");
}

Verb feasibility_verb(Command& app) {
  return elsewhere(app, "feasibility", "Where a vehicle can hover safely, and where a way is too tight");
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view verb = argc > 1 ? argv[1] : "";
  if (verb == "compare" || verb == "feasibility") {
    ::execv(program(std::string(verb)).c_str(), argv);
    if (argc < 3 || std::string_view(argv[2]) != "--help") argc = 2;  // its options are that program's
  }
  auto verbs = verbs_of_one_process();
  verbs.insert(verbs.end(), {campaign_verb, keys_verb, feasibility_verb, compare_verb});
  return run_tool(argc, argv, verbs);
}
