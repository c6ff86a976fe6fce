// SPDX-License-Identifier: BSD-3-Clause
// study_anytime: worlds looked at after every flight. How often does the e-value ever pass 1/level, and, beside it, how
// often does the study itself ever name something (--studies: it is run after every flight, too)? Every world is one
// line of JSON in --out as soon as it is done; --from makes the table of such files.
#include <cmath>
#include <cstdio>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>

#include "core/study/inference/anytime.hpp"
#include "services/command_line/command_line.hpp"
#include "tests/study_worlds/in_parallel.hpp"
#include "tests/study_worlds/observe.hpp"
#include "tests/study_worlds/summary.hpp"

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
  request.seed = seed;
  request.flights = options.flights;
  request.size = options.size;
  if (!options.cause.empty()) request.causes = {options.cause};
  const HiddenWorld world = draw_world(request);
  auto chosen = with_reference(world, folder);
  chosen.minimum_detectable = false;
  study::Anytime anytime(chosen.sound);
  Watched watched;
  observe_each(world, folder, [&](const study::Observations& seen) {
    anytime.look(seen);
    if (options.studies) watched.named.push_back(told(study::study(seen, chosen)));
  });
  watched.log_e = anytime.log_e();
  watched.leading = std::ranges::max_element(anytime.causes(), {}, [](auto& c) { return c.second; })->first;
  return watched;
}

nlohmann::json to_json(const Watched& w, std::uint64_t seed, const std::string& cause) {
  return {{"seed", seed}, {"cause", cause}, {"log_e", w.log_e}, {"leading", w.leading}, {"named", w.named}};
}

Watched watched_from(const nlohmann::json& json) { return {json["log_e"], json["leading"], json["named"]}; }

std::vector<Watched> run(const Options& options) {
  std::vector<Watched> all;
  std::mutex writing;
  std::ofstream out(options.out, std::ios::app);
  in_parallel(options.jobs, static_cast<std::size_t>(options.worlds), [&](std::size_t k, auto& folder) {
    auto watched = watch(options, options.seed + k, folder);
    const std::lock_guard lock(writing);
    if (out) out << to_json(watched, options.seed + k, options.cause).dump() << std::endl;
    all.push_back(std::move(watched));
  });
  return all;
}

/// "5 of 249 (0.01 to 0.05)".
std::string text(const Rate& rate) {
  char line[64];
  std::snprintf(line, sizeof line, "%d of %d (%.3f to %.3f)", rate.hits, rate.n, rate.low(), rate.high());
  return line;
}

void report(const std::vector<Watched>& all) {
  for (const double level : {0.05, 0.015, 0.01}) {
    Rate alarms;
    std::vector<std::ptrdiff_t> after;
    for (const auto& w : all) {
      const auto at = std::ranges::find_if(w.log_e, [&](double e) { return e >= -std::log(level); });
      alarms.count(at != w.log_e.end());
      if (at != w.log_e.end()) after.push_back(at - w.log_e.begin() + 1);
    }
    std::ranges::sort(after);
    std::printf("e-value ever above %.0f: %s worlds", 1 / level, text(alarms).c_str());
    if (!after.empty()) std::printf(", the middle one after %td flights", after[after.size() / 2]);
    std::printf("\n");
  }
  std::map<std::string, std::size_t> leading;
  Rate ever, at_last;
  for (const auto& w : all) {
    if (w.log_e.back() >= std::log(20.0)) ++leading[w.leading];
    if (w.named.empty()) continue;
    ever.count(std::ranges::any_of(w.named, [](auto& n) { return n != "nothing"; }));
    at_last.count(w.named.back() != "nothing");
  }
  for (const auto& [name, count] : leading) std::printf("  leading: %s in %zu\n", name.c_str(), count);
  if (ever.n > 0)
    std::printf("the study after every flight: ever a name in %s worlds; after the last flight alone %s\n",
                text(ever).c_str(), text(at_last).c_str());
}

}  // namespace

int main(int argc, char** argv) {
  backwash::services::Command app{"Worlds looked at after every flight", "study_anytime"};
  Options options;
  app.add_option("--worlds", options.worlds).capture_default_str();
  app.add_option("--flights", options.flights).capture_default_str();
  app.add_option("--seed", options.seed, "of the first world").capture_default_str();
  app.add_option("--cause", options.cause, "hidden cause; default: none");
  app.add_option("--size", options.size, "in units of the effect-size table").capture_default_str();
  app.add_option("--jobs", options.jobs).capture_default_str();
  app.add_option("--out", options.out, "JSON lines, appended to");
  app.add_option("--from", options.from, "JSON lines of earlier runs instead of new worlds");
  app.add_flag("--studies", options.studies, "the study itself after every flight, too");
  if (const auto code = app.parse(argc, argv)) return *code;
  if (options.from.empty()) {
    report(run(options));
    return 0;
  }
  std::vector<Watched> all;
  for (const auto& file : options.from) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) all.push_back(watched_from(nlohmann::json::parse(line)));
  }
  report(all);
  return 0;
}
