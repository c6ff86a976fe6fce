// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <filesystem>

#include "core/report/compare_report.hpp"
#include "services/backwash/compare_output.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/verb.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

constexpr std::size_t kGapFlights = 10;
constexpr double kMostFlights = 100'000;  // of a scene and vehicle: weeks
const char* const kGapScene = "builtin:narrow-gap";

struct Options {
  std::vector<std::string> scenes{"builtin"}, vehicles{"builtin:quad-5in", "builtin:quad-7in"}, models;
  std::size_t flights = 10;
  std::uint64_t seed = 1;
  std::string report, out;
  bool json = false, force = false;
};

/// The maps that a --scenes argument stands for.
std::vector<std::string> maps_of(const std::string& scenes) {
  if (scenes == "builtin")
    return {"builtin:apartment", "builtin:corridors", kGapScene, "builtin:forest-1", "builtin:forest-2"};
  if (!std::filesystem::is_directory(scenes)) return {scenes};
  std::vector<std::string> maps;
  for (const auto& entry : std::filesystem::directory_iterator(scenes)) {
    const auto extension = entry.path().extension();
    if (extension == ".bt" || extension == ".ot") maps.push_back(entry.path().string());
  }
  if (maps.empty()) throw Failure(kNoInput, scenes + ":1: has no OctoMap file; name a folder with .bt or .ot files");
  std::ranges::sort(maps);
  return maps;
}

/// A number of its own for each scene and vehicle (FNV-1a), so that their draws do not depend on what else is compared.
std::uint64_t seed_for(std::uint64_t seed, const std::string& scene, const std::string& vehicle) {
  std::uint64_t hash = 14695981039346656037u;
  for (const char c : scene + '\n' + vehicle) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
  return hash + seed;
}

/// The models of the vehicles: those given, else the built-in ones of the same names.
std::vector<std::string> models_of(const Options& options) {
  if (options.models.empty()) {
    for (const auto& vehicle : options.vehicles) {
      if (!vehicle.starts_with("builtin:"))
        throw Failure(kUsage, "--vehicle " + vehicle + " has no model of its own; give one --model a vehicle");
    }
    return options.vehicles;
  }
  if (options.models.size() != options.vehicles.size())
    throw Failure(kUsage, "give one --model a --vehicle, in the same order, or none");
  return options.models;
}

/// Flies one scene with the vehicle of that number. Throws Interrupted after Ctrl-C, and then nothing of it is kept.
void fly_scene(report::Comparison& c, const Options& options, const std::string& map, std::size_t n,
               const std::string& model) {
  const std::string scene = map.starts_with("builtin:") ? map : std::filesystem::path(map).filename().string();
  const auto vehicle = read_vehicle(options.vehicles[n]);
  progress(scene + ", " + vehicle.name + ": building the world");
  const auto world =
      plan::build_world(read_map(map), read_model(model), vehicle, reach::Method::tight, std::nullopt, run_shown);
  const auto pairs = sim::draw_pairs(world->grid, world->distance, vehicle, options.flights,
                                     seed_for(options.seed, scene, vehicle.name));
  if (!pairs)
    throw Failure(kUnavailable, map + ":1: no two hover points 3 m apart; choose a wider map or a smaller vehicle");
  std::optional<sim::GapCampaign> gap;
  if (map == kGapScene) gap = sim::fly_narrow_gap(*world, kGapFlights, options.seed);
  progress(scene + ", " + vehicle.name + ": planning and flying");
  c.scenes.push_back(sim::compare_scene(scene, *world, *pairs, c.methods, run_shown));
  if (gap) c.gaps.push_back(*std::move(gap));
}

report::Comparison compare(const Options& options, const std::vector<std::string>& maps,
                           const std::vector<std::string>& models) {
  report::Comparison c{sim::compare_methods(), {}, {}, {}, {}, options.seed, options.flights, kVersion};
  finish_what_is_done();
  try {
    for (const auto& map : maps)
      for (std::size_t n = 0; n < options.vehicles.size(); ++n) fly_scene(c, options, map, n, models[n]);
  } catch (const Interrupted&) {
    if (c.scenes.empty())
      throw Failure(kInterrupted, "interrupted before the first scene was flown; nothing is written");
  }
  c.table = sim::tabulate(c.scenes, c.methods, options.seed);
  c.demands = sim::demands(c.table, c.methods);
  return c;
}

int run(const Options& options) {
  const auto models = models_of(options);
  check_outputs({options.report, options.out}, options.force);
  std::vector<std::string> maps;
  for (const auto& scenes : options.scenes)
    for (auto& map : maps_of(scenes)) maps.push_back(std::move(map));
  for (const auto& map : maps) read_map(map);  // all inputs are looked at before hours are spent on the first
  for (std::size_t n = 0; n < options.vehicles.size(); ++n) {
    read_reachability(read_vehicle(options.vehicles[n]), reach::Method::tight, reach::Loop::vehicle,
                      options.vehicles[n]);
    read_model(models[n]);
  }
  const auto comparison = compare(options, maps, models);
  if (!options.out.empty()) write_file(options.out, to_csv(comparison), options.force);
  if (!options.report.empty()) {
    progress("drawing the report");
    const auto page = report::comparison_report(comparison);
    if (!page) throw Failure(kUnavailable, options.report + ":1: " + page.error().message);
    write_file(options.report, *page, options.force);
  }
  options.json ? print(to_json(comparison)) : print_text(comparison);
  if (interrupted())
    throw Failure(kInterrupted, "interrupted after " + std::to_string(comparison.scenes.size()) + " of " +
                                    std::to_string(maps.size() * models.size()) +
                                    " scenes and vehicles; these are judged and written");
  return kOk;
}

}  // namespace

Verb compare_verb(Command& app) {
  auto options = std::make_shared<Options>();
  auto& command =
      app.add_subcommand("compare", "The paper's Table I: sets against constant margins, flown in closed loop");
  command
      .add_option("--scenes", options->scenes,
                  "builtin (apartment, corridors, narrow-gap, two forests), a folder of OctoMap files, one such file, "
                  "builtin:NAME; several may be given")
      .capture_default_str();
  command.add_option("--flights", options->flights, "start-goal pairs a scene and vehicle")
      .check(within(1, kMostFlights))
      .capture_default_str();
  command.add_option("--seed", options->seed, "of the pairs, the air and the estimate's error").capture_default_str();
  command.add_option("--vehicle", options->vehicles, "vehicle files or builtin:NAME").capture_default_str();
  command.add_option("--model", options->models, "one model a vehicle; a built-in vehicle has its own");
  command.add_option("--report", options->report, "self-contained HTML page");
  command.add_option("--out", options->out, "CSV, one line a pair and method");
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.add_flag("--force", options->force, "replace existing files");
  command.footer(
      "Example:\n  backwash compare --scenes builtin --flights 4 --seed 1 --report compare.html --out compare.csv");
  return {&command, [options] { return run(*options); }};
}

}  // namespace backwash::services
