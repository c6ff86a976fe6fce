// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdio>
#include <exception>

#include "services/backwash/verb.hpp"
#include "version.hpp"

namespace {

int fail(const std::string& verb, int exit_code, std::string line) {
  std::replace(line.begin(), line.end(), '\n', ' ');
  std::fprintf(stderr, "backwash%s: %s\n", verb.c_str(), line.c_str());
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace backwash::services;
  CLI::App app{"backwash: reachable sets of a quadrotor in its own wash, from a voxel map", "backwash"};
  std::vector<Verb> verbs;
  std::string verb;
  try {
    app.set_version_flag("--version", std::string("backwash ") + backwash::kVersion);
    app.require_subcommand(1);
    verbs = {fly_verb(app),         plan_verb(app),    reach_verb(app),  field_verb(app),     simulate_verb(app),
             feasibility_verb(app), compare_verb(app), report_verb(app), calibrate_verb(app), import_verb(app),
             replay_verb(app),      study_verb(app),   vehicle_verb(app)};
    for (const auto& v : verbs) {
      v.command->preparse_callback([&verb, &v](std::size_t) { verb = " " + v.command->get_name(); });
    }
    app.parse(argc, argv);
    for (const auto& v : verbs) {
      if (v.command->parsed()) return v.run();
    }
    return kUsage;
  } catch (const CLI::Success& help_or_version) {
    return app.exit(help_or_version);
  } catch (const CLI::ParseError& wrong) {
    return fail(verb, kUsage, std::string(wrong.what()) + "; see backwash" + verb + " --help");
  } catch (const Failure& failure) {
    return fail(verb, failure.exit_code, failure.what());
  } catch (const std::exception& defect) {
    return fail(verb, kInternal, std::string("internal error: ") + defect.what() + "; please report it");
  }
}
