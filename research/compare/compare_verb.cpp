// SPDX-License-Identifier: BSD-3-Clause
#include "research/compare/compare_verb.hpp"

#include <cstdio>
#include <filesystem>

#include "research/compare/compare_input.hpp"
#include "research/compare/compare_output.hpp"
#include "research/compare/compare_report.hpp"
#include "research/compare/compare_rows.hpp"
#include "services/backwash/files.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

constexpr std::size_t kGapFlights = 10;
constexpr double kMostFlights = 100'000;  // of a scene and vehicle: weeks
const char* const kGapScene = "builtin:narrow-gap";

struct CompareOptions {
  std::vector<std::string> scenes{"builtin"}, vehicles{"builtin:quad-5in", "builtin:quad-7in"}, models;
  std::size_t flights = 10;
  std::uint64_t seed = 1;
  std::string report, out, from;
  std::optional<std::pair<std::size_t, std::size_t>> pairs;  // first, and the one behind the last
  bool json = false, force = false, rows = false, untimed = false;
};

/// A number of its own for each scene and vehicle (FNV-1a), so that their draws do not depend on what else is compared.
std::uint64_t seed_for(std::uint64_t seed, const std::string& scene, const std::string& vehicle) {
  std::uint64_t hash = 14695981039346656037u;
  for (const char c : scene + '\n' + vehicle) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
  return hash + seed;
}

std::size_t first_pair(const CompareOptions& options) { return options.pairs ? options.pairs->first : 0; }

/// Flies one scene with the vehicle of that number. Throws Interrupted after Ctrl-C, and then nothing of it is kept.
void fly_scene(report::Comparison& c, const CompareOptions& options, const std::string& map, std::size_t n,
               const std::string& model) {
  const std::string scene = map.starts_with("builtin:") ? map : std::filesystem::path(map).filename().string();
  const auto vehicle = read_vehicle(options.vehicles[n]);
  progress(scene + ", " + vehicle.name + ": building the world");
  const auto world =
      plan::build_world(read_map(map), read_model(model), vehicle, reach::Method::tight, std::nullopt, run_shown);
  auto pairs = sim::draw_pairs(world->grid, world->distance, vehicle, options.flights,
                               seed_for(options.seed, scene, vehicle.name));
  if (!pairs)
    throw Failure(kUnavailable, map + ":1: no two hover points 3 m apart; choose a wider map or a smaller vehicle");
  if (options.pairs)
    pairs = std::vector(pairs->begin() + std::ptrdiff_t(options.pairs->first),
                        pairs->begin() + std::ptrdiff_t(options.pairs->second));
  std::optional<sim::GapCampaign> gap;
  if (map == kGapScene && first_pair(options) == 0) gap = sim::fly_narrow_gap(*world, kGapFlights, options.seed);
  progress(scene + ", " + vehicle.name + ": planning and flying");
  c.scenes.push_back(sim::compare_scene(scene, *world, *pairs, c.methods, run_shown));
  if (gap) c.gaps.push_back(*std::move(gap));
}

report::Comparison nothing_yet(const CompareOptions& options) {
  report::Comparison c{sim::compare_methods(), {}, {}, {}, {}, options.seed, options.flights, kVersion};
  c.timed = !options.untimed && options.from.empty();
  return c;
}

void judge(report::Comparison& c) {
  c.table = sim::tabulate(c.scenes, c.methods, c.seed);
  c.demands = sim::demands(c.table, c.methods);
}

report::Comparison compare(const CompareOptions& options, const std::vector<std::string>& maps,
                           const std::vector<std::string>& models) {
  auto c = nothing_yet(options);
  finish_what_is_done();
  try {
    for (const auto& map : maps)
      for (std::size_t n = 0; n < options.vehicles.size(); ++n) fly_scene(c, options, map, n, models[n]);
  } catch (const Interrupted&) {
    if (c.scenes.empty())
      throw Failure(kInterrupted, "interrupted before the first scene was flown; nothing is written");
  }
  if (!options.rows) judge(c);
  return c;
}

/// The comparison that rows of parts of it add up to.
report::Comparison from_rows(const CompareOptions& options) {
  auto c = nothing_yet(options);
  add_rows(c, options.from);
  judge(c);
  return c;
}

void check(const CompareOptions& options) {
  if (options.rows && !(options.report.empty() && options.out.empty() && options.from.empty() && !options.json))
    throw Failure(kUsage, "--rows prints rows and nothing else; give it without --json, --from, --out and --report");
  if (!options.pairs) return;
  if (!options.rows) throw Failure(kUsage, "--pairs is a part of the comparison, which --rows prints; give both");
  if (options.pairs->first >= options.pairs->second || options.pairs->second > options.flights)
    throw Failure(kUsage, "--pairs must be FIRST:END with FIRST below END and END up to --flights");
}

report::Comparison compare(const CompareOptions& options) {
  const auto models = models_of(options.vehicles, options.models);
  const auto maps = maps_of(options.scenes);
  for (const auto& map : maps) read_map(map);  // all inputs are looked at before hours are spent on the first
  for (std::size_t n = 0; n < options.vehicles.size(); ++n) {
    read_reachability(read_vehicle(options.vehicles[n]), reach::Method::tight, reach::Loop::vehicle,
                      options.vehicles[n]);
    read_model(models[n]);
  }
  return compare(options, maps, models);
}

int run(const CompareOptions& options) {
  check(options);
  check_outputs({options.report, options.out}, options.force);
  const auto comparison = options.from.empty() ? compare(options) : from_rows(options);
  if (options.rows) {
    if (interrupted()) throw Failure(kInterrupted, "interrupted; no row is printed");
    std::fputs(to_rows(comparison, first_pair(options)).c_str(), stdout);
    return kOk;
  }
  if (!options.out.empty()) write_file(options.out, to_csv(comparison), options.force);
  if (!options.report.empty()) {
    progress("drawing the report");
    write_file(options.report, report::comparison_report(comparison), options.force);
  }
  options.json ? print(services::to_json(comparison)) : services::print_text(comparison);
  if (interrupted())
    throw Failure(kInterrupted, "interrupted after " + std::to_string(comparison.scenes.size()) + " of " +
                                    std::to_string(maps_of(options.scenes).size() * options.vehicles.size()) +
                                    " scenes and vehicles; these are judged and written");
  return kOk;
}

}  // namespace

Verb compare_verb(Command& app) {
  auto options = std::make_shared<CompareOptions>();
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
  const auto pairs = [options](const std::string& text) {
    std::size_t first = 0, end = 0;
    char rest = 0;
    if (std::sscanf(text.c_str(), "%zu:%zu%c", &first, &end, &rest) != 2)
      throw UsageError("--pairs: '" + text + "' must be FIRST:END, two whole numbers");
    options->pairs = {first, end};
  };
  command.add_text("--pairs", pairs, "of the --flights of each scene only these, from 0, END left out; with --rows")
      .type_name("FIRST:END");
  command.add_flag("--rows", options->rows, "prints each pair as a line of JSON, untimed, and nothing else");
  command.add_option("--from", options->from, "such lines, in order, in place of flights").type_name("FILE");
  command.add_flag("--untimed", options->untimed, "without planning times: the same bytes for the same inputs");
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.add_flag("--force", options->force, "replace existing files");
  command.footer(
      "Example:\n  backwash compare --scenes builtin --flights 4 --seed 1 --report compare.html --out compare.csv");
  return {&command, [options] { return run(*options); }};
}

}  // namespace backwash::services
