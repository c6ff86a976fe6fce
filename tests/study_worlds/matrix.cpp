// SPDX-License-Identifier: BSD-3-Clause
// study_matrix: how often the study names what was hidden. Every world is one line of JSON in --out as soon as it is
// done, so that a cut run counts; --from makes the tables of such files. --gate: exit 1 when a gate is missed.
#include <chrono>
#include <cstdio>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <random>

#include "services/command_line/command_line.hpp"
#include "tests/study_worlds/in_parallel.hpp"
#include "tests/study_worlds/null_size.hpp"
#include "tests/study_worlds/summary.hpp"

namespace {

using namespace study_worlds;

struct Options {
  int worlds = 20, flights = 12, jobs = 1;
  std::uint64_t seed = static_cast<std::uint64_t>(std::chrono::system_clock::now().time_since_epoch().count());
  std::vector<double> sizes = {1};
  std::vector<std::string> cells, from;
  std::string out, markdown;
  bool gate = false, null_size = false, rows = false;
};

/// The one size, or log-uniform between the two by the world's seed.
double size_of(const Options& options, std::uint64_t seed) {
  if (options.sizes.size() < 2) return options.sizes.front();
  std::mt19937_64 rng(seed + 99);
  const double low = std::log(options.sizes[0]), high = std::log(options.sizes[1]);
  return std::exp(std::uniform_real_distribution(low, high)(rng));
}

/// The causes of "ceiling + payload"; empty: not such a name.
std::vector<std::string> joined_causes(const std::string& name) {
  static const std::string kAnd = " + ";
  std::vector<std::string> causes;
  for (std::size_t at = 0, end; at <= name.size(); at = end + kAnd.size()) {
    end = std::min(name.find(kAnd, at), name.size());
    causes.push_back(name.substr(at, end - at));
    if (std::ranges::find(cause_names(), causes.back()) == cause_names().end()) return {};
  }
  return causes;
}

std::vector<MatrixCell> chosen_cells(const Options& options) {
  if (options.cells.empty()) return cells();
  std::vector<MatrixCell> chosen;
  for (const auto& name : options.cells) {
    const auto at = std::find_if(cells().begin(), cells().end(), [&](auto& c) { return c.name == name; });
    const auto causes = joined_causes(name);
    if (at == cells().end() && causes.empty()) throw backwash::services::UsageError("--cell: no cell '" + name + "'");
    chosen.push_back(at == cells().end() ? MatrixCell{name, causes} : *at);
  }
  return chosen;
}

/// Worlds outside, cells inside: a cut run has as many worlds of each cell.
std::vector<WorldOutcome> run(const Options& options) {
  const auto chosen = chosen_cells(options);
  std::vector<WorldOutcome> outcomes;
  std::mutex writing;
  std::ofstream out(options.out, std::ios::app);
  in_parallel(options.jobs, chosen.size() * static_cast<std::size_t>(options.worlds), [&](std::size_t k, auto& folder) {
    const std::uint64_t seed = options.seed + k / chosen.size();
    auto outcome = score(chosen[k % chosen.size()], seed, size_of(options, seed), options.flights, folder);
    if (options.rows) outcome.study_s = outcome.world_s = 0;
    const std::lock_guard lock(writing);
    if (options.rows) std::printf("%s\n", to_json(outcome).dump().c_str());
    if (out) out << to_json(outcome).dump() << std::endl;
    outcomes.push_back(std::move(outcome));
  });
  return outcomes;
}

std::vector<WorldOutcome> read(const std::vector<std::string>& files) {
  std::vector<WorldOutcome> outcomes;
  for (const auto& file : files) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) outcomes.push_back(from_json(nlohmann::json::parse(line)));
  }
  return outcomes;
}

int report(const Options& options) {
  if (options.rows) {
    run(options);
    return 0;
  }
  const auto outcomes = options.from.empty() ? run(options) : read(options.from);
  const auto summary = summarise(outcomes);
  const std::string page = markdown(summary, outcomes);
  std::fputs(page.c_str(), stdout);
  if (!options.markdown.empty()) std::ofstream(options.markdown) << page;
  if (!options.gate) return 0;
  const auto all = gates(summary);
  return std::all_of(all.begin(), all.end(), [](auto& g) { return g.held; }) ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  backwash::services::Command app{"Confusion matrix of the study over worlds with hidden effects", "study_matrix"};
  Options options;
  app.add_option("--worlds", options.worlds, "per cell").capture_default_str();
  app.add_option("--seed", options.seed, "of the first world; default: the clock");
  app.add_option("--sizes", options.sizes, "in units of the effect-size table; two: log-uniform between")
      .expected(1, 2);
  app.add_option("--flights", options.flights).capture_default_str();
  app.add_option("--cell", options.cells, "cells, or causes as \"ceiling + payload\"; default: all");
  app.add_option("--jobs", options.jobs).capture_default_str();
  app.add_option("--out", options.out, "JSON lines, appended to");
  app.add_option("--from", options.from, "JSON lines of earlier runs instead of new worlds");
  app.add_option("--markdown", options.markdown, "writes the tables there too");
  app.add_flag("--rows", options.rows, "prints the worlds as lines of JSON, times as 0, and nothing else");
  app.add_flag("--gate", options.gate, "exit 1 when a gate is missed");
  app.add_flag("--null-size", options.null_size, "instead: how often each channel rejects regressors without effect");
  if (const auto code = app.parse(argc, argv)) return *code;
  if (options.from.empty() && !options.rows)
    std::printf("seed %llu, %d worlds a cell, %d flights\n\n", static_cast<unsigned long long>(options.seed),
                options.worlds, options.flights);
  if (!options.null_size) return report(options);
  NullSize all;
  std::mutex adding;
  in_parallel(options.jobs, static_cast<std::size_t>(options.worlds), [&](std::size_t k, auto& folder) {
    const NullSize one = null_size(options.seed + k, options.flights, folder);
    const std::lock_guard lock(adding);
    add(all, one);
  });
  std::fputs(markdown(all).c_str(), stdout);
  return 0;
}
