// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/tool.hpp"

#include <algorithm>
#include <cstdio>
#include <exception>

#include "services/backwash/json.hpp"
#include "services/command_line/words.hpp"
#include "services/parallel/parallel.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

int fail(const std::string& line, int exit_code, const std::string& what) {
  end_progress();
  std::fflush(stdout);
  say_error(line, what);
  return exit_code;
}

/// A command line of verbs.
struct Line {
  Command app{"backwash: reachable sets of a quadrotor in its own wash, from a voxel map", "backwash"};
  bool quiet = false;
  std::optional<std::uint64_t> threads;
  std::vector<Verb> verbs;

  explicit Line(const std::vector<Verb (*)(Command&)>& made) {
    app.version(kVersion);
    app.require_subcommand();
    for (const auto& make : made) verbs.push_back(make(app));
    app.each_verb([&](Command& verb) {
      verb.add_flag("--quiet", quiet, "no progress on stderr");
      verb.add_option("--threads", threads, "at most so many; default: one a processor").check(within(1, 1024));
    });
  }

  /// The exit code of the verb that was read.
  int run() const {
    if (quiet) be_quiet();
    if (threads) limit_threads(static_cast<unsigned>(*threads));
    const auto asked = std::ranges::find_if(verbs, [](const Verb& v) { return v.command->parsed(); });
    return asked == verbs.end() ? static_cast<int>(kUsage) : asked->run();
  }
};

}  // namespace

std::vector<Verb (*)(Command&)> verbs_of_one_process() {
  return {fly_verb,    plan_verb,   reach_verb, field_verb, simulate_verb, report_verb,  calibrate_verb, import_verb,
          replay_verb, export_verb, merge_verb, study_verb, adapt_verb,    vehicle_verb, map_verb};
}

std::string answer(const std::vector<std::string>& words) {
  std::vector<const char*> line{"backwash"};
  for (const auto& word : words) line.push_back(word.c_str());
  line.push_back("--json");
  Line asked(verbs_of_one_process());
  asked.app.read(static_cast<int>(line.size()), line.data());
  return printed_by([&] { asked.run(); });
}

int run_tool(int argc, char** argv, const std::vector<Verb (*)(Command&)>& verbs) {
  std::setvbuf(stdout, nullptr, _IOFBF, BUFSIZ);  // results come when the progress is taken away
  Line line(verbs);
  try {
    if (const auto code = line.app.parse(argc, argv)) return *code;
    const int code = line.run();
    end_progress();
    return finished(code, line.app.line());
  } catch (const Failure& failure) {
    return fail(line.app.line(), failure.exit_code, failure.what());
  } catch (const std::exception& defect) {
    return fail(line.app.line(), kSoftware, std::string("internal error: ") + defect.what() + "; please report it");
  }
}

}  // namespace backwash::services
