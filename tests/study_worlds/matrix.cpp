// SPDX-License-Identifier: BSD-3-Clause
// study_matrix: how often the study names what was hidden. One line per hidden cause, one JSON line per world with
// --each.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>

#include "tests/study_worlds/observe.hpp"

namespace {

/// Upper end of Wilson's 95 % interval.
double wilson_upper(int hits, int n) {
  const double z = 1.96, p = static_cast<double>(hits) / n, q = z * z / n;
  return (p + q / 2 + z * std::sqrt(p * (1 - p) / n + q / (4 * n))) / (1 + q);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Confusion matrix of the study over worlds with hidden effects"};
  int worlds = 20, flights = 12;
  std::uint64_t seed = static_cast<std::uint64_t>(std::chrono::system_clock::now().time_since_epoch().count());
  double size = 1;
  std::vector<std::string> cells;
  std::string confound;
  app.add_option("--worlds", worlds, "per cell")->capture_default_str();
  app.add_option("--seed", seed, "of the first world; default: the clock");
  app.add_option("--sizes", size, "in units of the effect-size table")->capture_default_str();
  app.add_option("--flights", flights)->capture_default_str();
  app.add_option("--cause", cells, "cells; default: all, unknown and none");
  app.add_option("--confound", confound);
  CLI11_PARSE(app, argc, argv);
  if (cells.empty()) {
    cells = study_worlds::cause_names();
    cells.insert(cells.end(), {"unknown", "none"});
  }
  const auto folder = std::filesystem::temp_directory_path() / ("study-matrix-" + std::to_string(::getpid()));
  std::printf("seed %llu, %d worlds a cell, %d flights, size %g\n", static_cast<unsigned long long>(seed), worlds,
              flights, size);
  double seconds = 0;
  int studies = 0;
  for (const auto& cell : cells) {
    std::map<std::string, int> counts;
    int right = 0, single_wrong = 0, in_set = 0;
    for (int k = 0; k < worlds; ++k) {
      study_worlds::Request request{seed + static_cast<std::uint64_t>(k), {}, size, flights, confound};
      if (cell != "none") request.causes = {cell};
      const auto world = study_worlds::draw_world(request);
      const auto seen = study_worlds::observe(world, folder);
      const std::clock_t start = std::clock();
      backwash::study::discrepancy::StudyOptions options;
      options.minimum_detectable = false;
      const auto result = backwash::study::discrepancy::study(seen, options);
      seconds += static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC, ++studies;
      const std::string told = study_worlds::told(result);
      ++counts[told];
      const bool named = cell == "none" ? told == "nothing" : cell == "unknown" ? told.starts_with("?") : told == cell;
      right += named ? 1 : 0;
      const bool contains = !result.causes.empty() && told.find(cell) != std::string::npos;
      in_set += named || contains ? 1 : 0;
      single_wrong += !named && !contains && told != "nothing" && !told.starts_with("?") ? 1 : 0;
    }
    std::printf("%-19s right %3d/%d  truth among what is told %3d  wrong name %2d (95 %% upper limit %.3f) ",
                cell.c_str(), right, worlds, in_set, single_wrong, wilson_upper(single_wrong, worlds));
    std::vector<std::pair<int, std::string>> order;
    for (const auto& [told, count] : counts) order.emplace_back(-count, told);
    std::sort(order.begin(), order.end());
    for (const auto& [count, told] : order) std::printf(" %d [%s]", -count, told.c_str());
    std::printf("\n");
    std::fflush(stdout);
  }
  std::printf("search %.2f s CPU a study\n", seconds / studies);
  std::filesystem::remove_all(folder);
  return 0;
}
