// SPDX-License-Identifier: BSD-3-Clause
// study_shares: how often the study tells a cause that acts in some of twelve flights, and which flights these are.
#include <cstdio>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>

#include "services/command_line/command_line.hpp"
#include "tests/study_worlds/in_parallel.hpp"
#include "tests/study_worlds/shares.hpp"

namespace {

using namespace study_worlds;

/// Scores every trial of every world on `jobs` threads, worlds outside: a cut run has as many of each trial.
auto run(const std::vector<SharedFault>& trials, std::uint64_t seed, int worlds, int jobs, std::ostream& lines) {
  std::vector<decltype(score(trials.front(), seed, {}))> outcomes;
  std::mutex writing;
  in_parallel(jobs, trials.size() * static_cast<std::size_t>(worlds), [&](std::size_t k, auto& folder) {
    auto outcome = score(trials[k % trials.size()], seed + k / trials.size(), folder);
    const std::lock_guard lock(writing);
    if (lines) lines << to_json(outcome).dump() << std::endl;
    outcomes.push_back(std::move(outcome));
  });
  return outcomes;
}

}  // namespace

int main(int argc, char** argv) {
  backwash::services::Command app{"Causes in some flights only: a table of what the study tells of them",
                                  "study_shares"};
  std::uint64_t seed = 1;
  int worlds = 20, jobs = 1;
  std::vector<std::string> faults = {"rpm", "rotor_sensor_fault", "propeller_damage", "payload", "trim"};
  std::vector<std::string> layouts = {"run", "any", "since"};
  std::vector<int> counts = {4, 6, 8};
  double size = 1;
  std::string out;
  app.add_option("--seed", seed, "of the first world").capture_default_str();
  app.add_option("--worlds", worlds, "per row").capture_default_str();
  app.add_option("--jobs", jobs).capture_default_str();
  app.add_option("--fault", faults, "causes of the generator, or rpm");
  app.add_option("--layout", layouts).check(backwash::services::one_of({"run", "any", "from", "since", "each"}));
  app.add_option("--count", counts, "flights of 12");
  app.add_option("--size", size, "in units of the effect-size table").capture_default_str();
  app.add_option("--out", out, "JSON lines, appended to");
  if (const auto code = app.parse(argc, argv)) return *code;
  std::ofstream lines(out, std::ios::app);
  std::vector<SharedFault> trials;
  for (const auto& fault : faults)
    for (const auto& layout : layouts)
      for (const int count : layout == "each" ? std::vector{12} : counts)
        trials.push_back({fault, count, layout, size});
  const std::string table = shares_table(run(trials, seed, worlds, jobs, lines));
  std::printf("seed %llu, %d worlds a row\n\n%s", static_cast<unsigned long long>(seed), worlds, table.c_str());
  return 0;
}
