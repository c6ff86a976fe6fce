// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/tool.hpp"

#include <cstdio>
#include <exception>

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

}  // namespace

int run_tool(int argc, char** argv, const std::vector<Verb (*)(Command&)>& made) {
  Command app{"backwash: reachable sets of a quadrotor in its own wash, from a voxel map", "backwash"};
  bool quiet = false;
  std::optional<std::uint64_t> threads;
  std::setvbuf(stdout, nullptr, _IOFBF, BUFSIZ);  // results come when the progress is taken away
  try {
    app.version(kVersion);
    app.require_subcommand();
    std::vector<Verb> verbs;
    for (const auto& make : made) verbs.push_back(make(app));
    app.each_verb([&](Command& verb) {
      verb.add_flag("--quiet", quiet, "no progress on stderr");
      verb.add_option("--threads", threads, "at most so many; default: one a processor").check(within(1, 1024));
    });
    if (const auto code = app.parse(argc, argv)) return *code;
    if (quiet) be_quiet();
    if (threads) limit_threads(static_cast<unsigned>(*threads));
    for (const auto& v : verbs) {
      if (!v.command->parsed()) continue;
      const int code = v.run();
      end_progress();
      return finished(code, app.line());
    }
    return kUsage;
  } catch (const Failure& failure) {
    return fail(app.line(), failure.exit_code, failure.what());
  } catch (const std::exception& defect) {
    return fail(app.line(), kSoftware, std::string("internal error: ") + defect.what() + "; please report it");
  }
}

}  // namespace backwash::services
