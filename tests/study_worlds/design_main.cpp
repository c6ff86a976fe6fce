// SPDX-License-Identifier: BSD-3-Clause
// study_design: worlds whose flights cannot tell some causes apart. How many further flights it takes until the hidden
// one is told alone, by the designed way and by others. Every world is one line of JSON in --out as soon as it is done;
// --from makes the tables of such files.
#include <cstdio>
#include <fstream>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>

#include "services/command_line/command_line.hpp"
#include "tests/study_worlds/design_trial.hpp"
#include "tests/study_worlds/in_parallel.hpp"

namespace {

using namespace study_worlds;

struct Options {
  int worlds = 20, jobs = 1;
  TrialOptions trial;
  std::uint64_t seed = 1;
  std::vector<std::string> cells = {"trim, no yaw turn",        "draft, no yaw turn",   "battery_sag, equal batteries",
                                    "payload, equal batteries", "ceiling, two heights", "ground_thrust, two heights"};
  std::vector<std::string> from;
  std::string out;
};

const MatrixCell& cell_of(const std::string& name) {
  const auto at = std::ranges::find(cells(), name, &MatrixCell::name);
  if (at == cells().end()) throw backwash::services::UsageError("--cell: no cell '" + name + "'");
  return *at;
}

std::vector<Trial> run(const Options& options) {
  std::vector<Trial> all;
  std::mutex writing;
  std::ofstream out(options.out, std::ios::app);
  in_parallel(options.jobs, options.cells.size() * static_cast<std::size_t>(options.worlds),
              [&](std::size_t k, auto& folder) {
                auto done = trial(cell_of(options.cells[k % options.cells.size()]),
                                  options.seed + k / options.cells.size(), options.trial, folder);
                const std::lock_guard lock(writing);
                if (out) out << to_json(done).dump() << std::endl;
                all.push_back(std::move(done));
              });
  return all;
}

double median(std::vector<int> x) {
  std::ranges::sort(x);
  const std::size_t n = x.size();
  return n == 0 ? 0 : 0.5 * (x[(n - 1) / 2] + x[n / 2]);
}

/// Medians of the flights needed; those that never separate count as one more than were flown.
void report(const std::vector<Trial>& all) {
  std::map<std::string, std::vector<const Trial*>> by_cell;
  for (const Trial& t : all) {
    by_cell[t.cell].push_back(&t);
    by_cell["all"].push_back(&t);
  }
  std::printf(
      "| cell | worlds | could not distinguish | expected | designed | same kind | free kind | of the list | within "
      "expected |\n");
  std::printf("| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  for (const auto& [name, trials] : by_cell) {
    std::array<std::vector<int>, std::size(kFurther)> needed;
    std::vector<int> expected;
    int applies = 0, told = 0, held = 0;
    for (const Trial* t : trials) {
      applies += t->applies;
      if (t->needed.empty()) continue;
      for (std::size_t k = 0; k < needed.size(); ++k) needed[k].push_back(t->needed[k]);
      if (t->expected > 0) {
        expected.push_back(t->expected);
        ++told;
        held += t->needed[0] <= t->expected;
      }
    }
    std::printf("| %s | %zu | %d | %.1f (%d) |", name.c_str(), trials.size(), applies, median(expected), told);
    for (const auto& x : needed) std::printf(" %.1f |", median(x));
    std::printf(" %d/%d |\n", held, told);
  }
}

}  // namespace

int main(int argc, char** argv) {
  backwash::services::Command app{"Further flights until the hidden cause is told alone", "study_design"};
  Options options;
  app.add_option("--worlds", options.worlds, "per cell").capture_default_str();
  app.add_option("--flights", options.trial.flights, "at first").capture_default_str();
  app.add_option("--most", options.trial.most, "further ones of each kind").capture_default_str();
  app.add_option("--seconds", options.trial.seconds, "of each further flight").capture_default_str();
  app.add_option("--size", options.trial.size, "in units of the effect-size table").capture_default_str();
  app.add_option("--seed", options.seed, "of the first world").capture_default_str();
  app.add_option("--cell", options.cells, "cells; default: the confounded ones");
  app.add_option("--jobs", options.jobs).capture_default_str();
  app.add_option("--out", options.out, "JSON lines, appended to");
  app.add_option("--from", options.from, "JSON lines of earlier runs instead of new worlds");
  if (const auto code = app.parse(argc, argv)) return *code;
  std::vector<Trial> all;
  for (const auto& file : options.from) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) all.push_back(trial_from_json(nlohmann::json::parse(line)));
  }
  report(options.from.empty() ? run(options) : all);
  return 0;
}
