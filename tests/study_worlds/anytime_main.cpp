// SPDX-License-Identifier: BSD-3-Clause
// study_anytime: worlds looked at after every flight. How often does the e-value ever pass 1/level, and, beside it, how
// often does the study itself ever name something (--studies: it is run after every flight, too)? Every world is one
// line of JSON in --out as soon as it is done; --from makes the table of such files.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "core/study/inference/anytime.hpp"
#include "tests/study_worlds/observe.hpp"

namespace {

using namespace study_worlds;
namespace study = backwash::study;

struct Options {
  int worlds = 100, flights = 40, jobs = 1;
  std::uint64_t seed = 1;
  double size = 1;
  std::string cause, out;
  std::vector<std::string> from;
  bool studies = false;
};

struct Watched {
  std::vector<double> log_e;       // after each flight
  std::string leading;             // cause with the most evidence at the end
  std::vector<std::string> named;  // by the study after each flight; empty: not asked
};

Watched watch(const Options& options, std::uint64_t seed, const std::filesystem::path& folder) {
  Request request;
  request.seed = seed, request.flights = options.flights, request.size = options.size;
  if (!options.cause.empty()) request.causes = {options.cause};
  study::Anytime anytime;
  Watched watched;
  observe_each(draw_world(request), folder, [&](const study::Observations& seen) {
    anytime.look(seen);
    study::StudyOptions chosen;
    chosen.minimum_detectable = chosen.dependence = false;
    if (options.studies) watched.named.push_back(told(study::study(seen, chosen)));
  });
  watched.log_e = anytime.log_e();
  watched.leading = std::ranges::max_element(anytime.causes(), {}, [](auto& c) { return c.second; })->first;
  return watched;
}

nlohmann::json to_json(const Watched& w, std::uint64_t seed, const std::string& cause) {
  return {{"seed", seed}, {"cause", cause}, {"log_e", w.log_e}, {"leading", w.leading}, {"named", w.named}};
}

Watched from_json(const nlohmann::json& json) { return {json["log_e"], json["leading"], json["named"]}; }

std::vector<Watched> run(const Options& options) {
  std::vector<Watched> all;
  std::mutex writing;
  std::atomic<int> next = 0;
  std::ofstream out(options.out, std::ios::app);
  std::vector<std::jthread> threads;
  for (int j = 0; j < options.jobs; ++j)
    threads.emplace_back([&, j] {
      const auto folder = std::filesystem::temp_directory_path() /
                          ("study-anytime-" + std::to_string(::getpid()) + "-" + std::to_string(j));
      for (int k = next++; k < options.worlds; k = next++) {
        const std::uint64_t seed = options.seed + static_cast<std::uint64_t>(k);
        auto watched = watch(options, seed, folder);
        const std::lock_guard lock(writing);
        if (out) out << to_json(watched, seed, options.cause).dump() << std::endl;
        all.push_back(std::move(watched));
      }
      std::filesystem::remove_all(folder);
    });
  threads.clear();
  return all;
}

/// "5 of 249 (0.01 to 0.05)": Wilson's interval.
std::string share(std::size_t hits, std::size_t of) {
  const double n = static_cast<double>(of), p = static_cast<double>(hits) / n, z2 = 3.8415;
  const double middle = (p + z2 / (2 * n)) / (1 + z2 / n);
  const double half = std::sqrt(z2 * (p * (1 - p) / n + z2 / (4 * n * n))) / (1 + z2 / n);
  char line[64];
  std::snprintf(line, sizeof line, "%zu of %zu (%.3f to %.3f)", hits, of, middle - half, middle + half);
  return line;
}

void report(const std::vector<Watched>& all) {
  if (all.empty()) return;
  for (const double level : {0.05, 0.015, 0.01}) {
    std::vector<std::size_t> after;
    for (const auto& w : all) {
      const auto at = std::ranges::find_if(w.log_e, [&](double e) { return e >= -std::log(level); });
      if (at != w.log_e.end()) after.push_back(static_cast<std::size_t>(at - w.log_e.begin()) + 1);
    }
    std::ranges::sort(after);
    std::printf("e-value ever above %.0f: %s worlds", 1 / level, share(after.size(), all.size()).c_str());
    if (!after.empty()) std::printf(", the middle one after %zu flights", after[after.size() / 2]);
    std::printf("\n");
  }
  std::map<std::string, std::size_t> leading;
  for (const auto& w : all)
    if (w.log_e.back() >= std::log(20.0)) ++leading[w.leading];
  for (const auto& [name, count] : leading) std::printf("  leading: %s in %zu\n", name.c_str(), count);
  std::size_t asked = 0, ever = 0, at_last = 0;
  for (const auto& w : all) {
    if (w.named.empty()) continue;
    ++asked;
    ever += std::ranges::any_of(w.named, [](auto& n) { return n != "nothing"; }) ? 1 : 0;
    at_last += w.named.back() != "nothing" ? 1 : 0;
  }
  if (asked > 0)
    std::printf("the study after every flight: ever a name in %s worlds; after the last flight alone %s\n",
                share(ever, asked).c_str(), share(at_last, asked).c_str());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Worlds looked at after every flight"};
  Options options;
  app.add_option("--worlds", options.worlds)->capture_default_str();
  app.add_option("--flights", options.flights)->capture_default_str();
  app.add_option("--seed", options.seed, "of the first world")->capture_default_str();
  app.add_option("--cause", options.cause, "hidden cause; default: none");
  app.add_option("--size", options.size, "in units of the effect-size table")->capture_default_str();
  app.add_option("--jobs", options.jobs)->capture_default_str();
  app.add_option("--out", options.out, "JSON lines, appended to");
  app.add_option("--from", options.from, "JSON lines of earlier runs instead of new worlds");
  app.add_flag("--studies", options.studies, "the study itself after every flight, too");
  CLI11_PARSE(app, argc, argv);
  if (options.from.empty()) {
    report(run(options));
    return 0;
  }
  std::vector<Watched> all;
  for (const auto& file : options.from) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) all.push_back(from_json(nlohmann::json::parse(line)));
  }
  report(all);
  return 0;
}
