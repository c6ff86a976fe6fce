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
  Command app{"backwash: reachable sets of a quadrotor in its own wash, from a voxel map", "backwash"};
  std::vector<Verb> verbs;
  std::string verb;
  try {
    app.version(backwash::kVersion);
    app.require_subcommand();
    verbs = {fly_verb(app),         plan_verb(app),    reach_verb(app),  field_verb(app),     simulate_verb(app),
             feasibility_verb(app), compare_verb(app), report_verb(app), calibrate_verb(app), import_verb(app),
             replay_verb(app),      study_verb(app),   adapt_verb(app),  vehicle_verb(app),   map_verb(app)};
    if (const auto code = app.parse(argc, argv)) return *code;
    for (const auto& v : verbs) {
      if (!v.command->parsed()) continue;
      verb = " " + v.command->name();
      return finished(v.run(), "backwash" + verb);
    }
    return backwash::kUsage;
  } catch (const Failure& failure) {
    return fail(verb, failure.exit_code, failure.what());
  } catch (const std::exception& defect) {
    return fail(verb, backwash::kSoftware, std::string("internal error: ") + defect.what() + "; please report it");
  }
}
