// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>
#include <filesystem>

#include "core/plan/feasibility.hpp"
#include "core/sim/flight.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/fly/flight_output.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/page_parts.hpp"
#include "services/backwash/site/world_cache.hpp"
#include "services/backwash/verb.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

struct FlyOptions {
  std::string map = "builtin:apartment", vehicle = "builtin:quad-5in", model, report, log;
  std::optional<Vec3> start, goal;
  std::optional<double> risk;
  std::uint64_t seed = 1;
  double sigma_scale = 1;
  bool json = false, force = false, ends = false;
};

/// Flights of maps that everybody has, chosen with `backwash feasibility`.
struct DefaultFlight {
  const char* map;  ///< builtin:NAME, or the file's name without its folder
  Vec3 start_W, goal_W;
};
const DefaultFlight kDefaultFlights[] = {
    {"builtin:apartment", {3.0, 4.2, 1.2}, {7.4, 3.0, 1.2}},  // living room to bedroom through the doorway at x = 5.9 m
    {"geb079.bt", {13.08, 0.68, 1.16}, {26.52, -0.52, 0.76}},  // along the corridor
};

/// Start and goal that need no search: those given, or the map's own.
std::optional<plan::HoverPair> known_ends(const FlyOptions& options) {
  if (options.start) return plan::HoverPair{*options.start, *options.goal};
  for (const auto& known : kDefaultFlights) {
    if (options.map == known.map || std::filesystem::path(options.map).filename() == known.map)
      return plan::HoverPair{known.start_W, known.goal_W};
  }
  return std::nullopt;
}

plan::HoverPair choose_ends(const FlyOptions& options, const plan::World& world, sim::FlightOptions flight) {
  if (const auto known = known_ends(options)) return *known;
  const auto pair = plan::farthest_pair(world, plan::hover_regions(world), [&](const Vec3& start_W) {
    flight.start_W = start_W;
    // The vehicle will not believe itself exactly there: the estimate may be off by this much.
    const auto rise = sim::take_off(world, flight);
    return rise && rise->clearance_m > world.reach.vehicle.estimation.position;
  });
  if (!pair) {
    throw Failure(kUnavailable, options.map +
                                    ":1: no hover-safe place to take off to from a known floor; give --start "
                                    "and --goal, or a smaller vehicle");
  }
  return *pair;
}

void write_flight(const FlyOptions& options, const sim::Flight& flight) {
  auto samples = flight.take_off.samples;
  // The route's first sample is the take-off's last tick again.
  samples.insert(samples.end(), flight.route.samples.begin() + 1, flight.route.samples.end());
  services::write_log(options.log, sim::to_log(samples), options.force);
}

int print_ends(const plan::HoverPair& ends) {
  for (const Vec3& p : {ends.start_W, ends.goal_W}) std::printf("%.3f,%.3f,%.3f\n", p.x(), p.y(), p.z());
  return kOk;
}

int run(const FlyOptions& options) {
  if (options.start.has_value() != options.goal.has_value())
    throw Failure(kUsage, "give both --start and --goal, or neither");
  check_outputs({options.report, options.log}, options.force);
  const auto [vehicle, model] = read_both(options.vehicle, options.model, options.risk);
  const std::string model_path = model_of(options.vehicle, options.model);
  auto grid = read_map(options.map);
  if (const auto known = known_ends(options); options.ends && known) return print_ends(*known);
  const auto world = world_of({std::move(grid), model, model_path, vehicle, options.vehicle});
  sim::FlightOptions flight_options{.start_W = Vec3::Zero(),
                                    .goal_W = Vec3::Zero(),
                                    .seed = options.seed,
                                    .sigma_scale = options.sigma_scale,
                                    .terms = read_simulation(model_path),
                                    .limits = {.v_max = vehicle.limits.v_max, .a_max = vehicle.limits.a_max}};
  const auto ends = choose_ends(options, *world, flight_options);
  flight_options.start_W = ends.start_W;
  flight_options.goal_W = ends.goal_W;
  if (options.ends) return print_ends(ends);
  progress("flying");
  const auto flight = sim::fly(*world, vehicle, model.bound, flight_options);
  if (!flight) throw Failure(kUnavailable, options.map + ":1: " + flight.error().message);
  if (!options.log.empty()) write_flight(options, *flight);
  const report::ReportContext context{
      options.map, model_path,   options.vehicle,     kVersion,      ends.start_W,
      ends.goal_W, options.seed, options.sigma_scale, own_command(), parameter_files(options.vehicle, model_path)};
  return conclude({*flight, *world, context, sim::summarise(*flight, *world, ends.goal_W)}, options.report,
                  options.json, options.force);
}

}  // namespace

Verb fly_verb(Command& app) {
  auto options = std::make_shared<FlyOptions>();
  auto& command =
      app.add_subcommand("fly", "One closed-loop flight in simulated airflow, judged against its reachable sets");
  command.add_option("--map", options->map, "OctoMap file or builtin:NAME").capture_default_str();
  command.add_option("--vehicle", options->vehicle, "vehicle file or builtin:NAME").capture_default_str();
  command.add_option("--model", options->model, "model file or builtin:NAME; a built-in vehicle has its own");
  add_point(command, "--start", options->start, "hover point above the take-off, m; by default one of the map's");
  add_point(command, "--goal", options->goal, "hover point to reach, m; by default one of the map's");
  command.add_option("--seed", options->seed, "of the airflow and of the VIO error").capture_default_str();
  command.add_option("--sigma-scale", options->sigma_scale, "judge with sets of the variance times this")
      .check(within(1e-6, 1e6))
      .capture_default_str();
  add_risk(command, options->risk);
  command.add_option("--report", options->report, "HTML page to write");
  command.add_option("--log", options->log, "flight log to write, CSV");
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.add_flag("--ends", options->ends, "only print the start and the goal that would be flown");
  command.add_flag("--force", options->force, "overwrite --report and --log");
  command.footer(
      "Exit code 0 if the goal was reached, nothing was touched and every measured position lay inside the set "
      "predicted\n"
      "for it; 1 if not; 69 if the flight was refused.\nExample:\n  backwash fly --map builtin:apartment --report "
      "flight.html");
  return {&command, [options] { return run(*options); }};
}

}  // namespace backwash::services
