// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "core/sim/flight.hpp"
#include "core/study/feasibility.hpp"
#include "core/study/report.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/verb.hpp"
#include "services/parallel/parallel.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

struct Options {
  std::string map = "builtin:apartment", vehicle = "builtin:quad-5in", model = "builtin:quad-5in", report, log;
  std::optional<Vec3> start, goal;
  std::uint64_t seed = 1;
  double sigma_scale = 1;
  bool json = false, force = false;
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

study::HoverPair choose_ends(const Options& options, const plan::World& world, sim::FlightOptions flight) {
  if (options.start) return {*options.start, *options.goal};
  for (const auto& known : kDefaultFlights) {
    if (options.map == known.map || std::filesystem::path(options.map).filename() == known.map) {
      return {known.start_W, known.goal_W};
    }
  }
  const auto pair = study::farthest_pair(world, study::hover_regions(world), [&](const Vec3& start_W) {
    flight.start_W = start_W;
    return sim::take_off(world, flight).has_value();
  });
  if (!pair) {
    throw Failure(kUnavailable, options.map +
                                    ":1: no hover-safe place to take off to from a known floor; give --start "
                                    "and --goal, or a smaller vehicle");
  }
  return *pair;
}

/// What went wrong, for the line on stderr; empty if nothing did.
std::string failures(const sim::FlightSummary& s) {
  std::string line;
  const auto add = [&line](const std::string& what) { line += (line.empty() ? "" : "; ") + what; };
  if (!s.goal_reached) add("the goal was missed by " + to_text(s.goal_error_m, 2) + " m");
  if (s.touched)
    add("an obstacle was touched (clearance " + to_text(std::min(s.clearance_m, s.take_off_clearance_m), 3) + " m)");
  if (s.inside != s.samples) {
    add(std::to_string(s.samples - s.inside) + " of " + std::to_string(s.samples) +
        " samples lay outside the set predicted for them; all must lie inside");
  }
  return line;
}

Json to_json(const sim::Flight& flight, const sim::FlightSummary& s, const study::HoverPair& ends,
             const Options& options) {
  const auto axes = [](const Vec3& v) { return Json{{"x", v.x()}, {"y", v.y()}, {"z", v.z()}}; };
  const auto method = [](const sim::MethodTube& m) {
    return Json{{"largest_half_axis_m", m.largest_half_axis_m},
                {"clearance_m", m.clearance_m},
                {"clear", m.clearance_m > 0},
                {"tube_ms", m.tube_ms}};
  };
  return {{"ok", s.ok()},
          {"goal_reached", s.goal_reached},
          {"touched", s.touched},
          {"map", options.map},
          {"start", services::to_json(ends.start_W)},
          {"goal", services::to_json(ends.goal_W)},
          {"seed", options.seed},
          {"sigma_scale", options.sigma_scale},
          {"length_m", s.length_m},
          {"time_s", s.time_s},
          {"goal_error_m", s.goal_error_m},
          {"min_clearance_m", s.clearance_m},
          {"take_off_clearance_m", s.take_off_clearance_m},
          {"planned_clearance_m", flight.tight.clearance_m},
          {"largest_error_over_bound", axes(s.largest_ratio)},
          {"samples", s.samples},
          {"samples_inside", s.inside},
          {"plan", services::to_json(flight.plan.metrics)},
          {"tight", method(flight.tight)},
          {"paper", method(flight.paper)}};
}

void print_text(const sim::Flight& flight, const sim::FlightSummary& s, const study::HoverPair& ends,
                const Options& options) {
  const auto& m = flight.plan.metrics;
  std::printf("flight               %s, %s to %s, seed %llu\n", options.map.c_str(), to_text(ends.start_W).c_str(),
              to_text(ends.goal_W).c_str(), static_cast<unsigned long long>(options.seed));
  std::printf("goal                 %s, %.3f m off at the end\n", s.goal_reached ? "reached" : "MISSED",
              s.goal_error_m);
  std::printf("path, time           %.2f m, %.2f s\n", s.length_m, s.time_s);
  std::printf("clearance            %.3f m at least, body to obstacle; %.3f m left over by the reachable set\n",
              s.clearance_m, flight.tight.clearance_m);
  std::printf("largest error/bound  x %.2f, y %.2f, z %.2f\n", s.largest_ratio.x(), s.largest_ratio.y(),
              s.largest_ratio.z());
  std::printf("inside the set       %zu of %zu samples\n", s.inside, s.samples);
  std::printf("planning             search %.1f ms, optimisation %.1f ms, verification %.1f ms\n", m.search_ms,
              m.optimise_ms, m.verify_ms);
  for (const auto& [name, method] : {std::pair{"exact supports", &flight.tight}, {"ellipsoids", &flight.paper}}) {
    std::printf("%-20s largest half axis %.3f m, tube %s (%.3f m), propagated in %.2f ms\n", name,
                method->largest_half_axis_m, method->clearance_m > 0 ? "clear" : "NOT clear", method->clearance_m,
                method->tube_ms);
  }
}

void write_report(const Options& options, const study::HoverPair& ends, const sim::Flight& flight,
                  const sim::FlightSummary& summary, const plan::World& world) {
  const study::ReportContext context{options.map,  options.model, options.vehicle, kVersion,
                                     ends.start_W, ends.goal_W,   options.seed,    options.sigma_scale};
  const auto page = study::flight_report(flight, summary, world, context);
  if (!page) throw Failure(kUnavailable, options.report + ":1: " + page.error().message);
  write_file(options.report, *page, options.force);
}

void write_log(const Options& options, const sim::Flight& flight) {
  auto samples = flight.take_off.samples;
  // The route's first sample is the take-off's last tick again.
  samples.insert(samples.end(), flight.route.samples.begin() + 1, flight.route.samples.end());
  const auto written = study::write_csv(options.log, sim::to_log(samples), options.force);
  if (!written) throw Failure(kCannotCreate, written.error().message);
}

int run(const Options& options) {
  if (options.start.has_value() != options.goal.has_value())
    throw Failure(kUsage, "give both --start and --goal, or neither");
  refuse_to_overwrite(options.report, options.force);
  refuse_to_overwrite(options.log, options.force);
  const auto vehicle = read_vehicle(options.vehicle);
  const auto model = read_model(options.model);
  read_reachability(vehicle, reach::Method::tight, reach::Loop::vehicle,
                    options.vehicle);  // names an unstable loop first
  auto grid = read_map(options.map);
  progress("building the world");
  const auto world = plan::build_world(std::move(grid), model, vehicle, reach::Method::tight, -1, run_parallel);
  sim::FlightOptions flight_options{.start_W = Vec3::Zero(),
                                    .goal_W = Vec3::Zero(),
                                    .seed = options.seed,
                                    .sigma_scale = options.sigma_scale,
                                    .limits = {.v_max = vehicle.limits.v_max, .a_max = vehicle.limits.a_max}};
  const auto ends = choose_ends(options, *world, flight_options);
  flight_options.start_W = ends.start_W, flight_options.goal_W = ends.goal_W;
  progress("flying");
  const auto flight = sim::fly(*world, vehicle, model.bound, flight_options);
  if (!flight) throw Failure(kUnavailable, options.map + ":1: " + flight.error().message);
  const auto summary = sim::summarise(*flight, *world, ends.goal_W);
  if (!options.log.empty()) write_log(options, *flight);
  if (!options.report.empty()) {
    progress("drawing the report");
    write_report(options, ends, *flight, summary, *world);
  }
  options.json ? print(to_json(*flight, summary, ends, options)) : print_text(*flight, summary, ends, options);
  if (summary.ok()) return kOk;
  throw Failure(kFlightFailed, options.map + ":1: " + failures(summary));
}

}  // namespace

Verb fly_verb(CLI::App& app) {
  auto options = std::make_shared<Options>();
  auto* command =
      app.add_subcommand("fly", "One closed-loop flight in simulated airflow, judged against its reachable sets");
  command->add_option("--map", options->map, "OctoMap file or builtin:NAME")->capture_default_str();
  command->add_option("--vehicle", options->vehicle, "vehicle file or builtin:NAME")->capture_default_str();
  command->add_option("--model", options->model, "model file or builtin:NAME")->capture_default_str();
  add_point(*command, "--start", options->start, "hover point above the take-off, m; by default one of the map's");
  add_point(*command, "--goal", options->goal, "hover point to reach, m; by default one of the map's");
  command->add_option("--seed", options->seed, "of the airflow and of the VIO error")->capture_default_str();
  command->add_option("--sigma-scale", options->sigma_scale, "judge with sets of the variance times this")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--report", options->report, "HTML page to write");
  command->add_option("--log", options->log, "flight log to write, CSV");
  command->add_flag("--json", options->json, "one JSON object on stdout");
  command->add_flag("--force", options->force, "overwrite --report and --log");
  command->footer(
      "Exit code 0 if the goal was reached, nothing was touched and every measured position lay inside the set "
      "predicted\n"
      "for it; 1 if not; 69 if the flight was refused.\nExample:\n  backwash fly --map builtin:apartment --report "
      "flight.html");
  return {command, [options] { return run(*options); }};
}

}  // namespace backwash::services
