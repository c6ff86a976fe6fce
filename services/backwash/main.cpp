// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>
#include <exception>

#include "services/backwash/verb.hpp"
#include "services/command_line/words.hpp"
#include "services/parallel/parallel.hpp"
#include "version.hpp"

namespace {

int fail(const std::string& line, int exit_code, const std::string& what) {
  backwash::services::end_progress();
  std::fflush(stdout);
  backwash::services::say_error(line, what);
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace backwash::services;
  Command app{"backwash: reachable sets of a quadrotor in its own wash, from a voxel map", "backwash"};
  std::vector<Verb> verbs;
  bool quiet = false;
  std::optional<std::uint64_t> threads;
  std::setvbuf(stdout, nullptr, _IOFBF, BUFSIZ);  // results come when the progress is taken away
  try {
    app.version(backwash::kVersion);
    app.require_subcommand();
    verbs = {fly_verb(app),         plan_verb(app),    reach_verb(app),    field_verb(app),     simulate_verb(app),
             feasibility_verb(app), compare_verb(app), report_verb(app),   calibrate_verb(app), import_verb(app),
             replay_verb(app),      export_verb(app),  merge_verb(app),    study_verb(app),     adapt_verb(app),
             vehicle_verb(app),     map_verb(app),     campaign_verb(app), keys_verb(app)};
    app.each_verb([&](Command& verb) {
      verb.add_flag("--quiet", quiet, "no progress on stderr");
      verb.add_option("--threads", threads, "at most so many; default: one a processor").check(within(1, 1024));
    });
    if (const auto code = app.parse(argc, argv)) return *code;
    if (quiet) be_quiet();
    if (threads) backwash::limit_threads(static_cast<unsigned>(*threads));
    for (const auto& v : verbs) {
      if (!v.command->parsed()) continue;
      const int code = v.run();
      end_progress();
      return finished(code, app.line());
    }
    return backwash::kUsage;
  } catch (const Failure& failure) {
    return fail(app.line(), failure.exit_code, failure.what());
  } catch (const std::exception& defect) {
    return fail(app.line(), backwash::kSoftware,
                std::string("internal error: ") + defect.what() + "; please report it");
  }
}
