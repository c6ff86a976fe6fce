// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>

#include "core/map/distance_field.hpp"
#include "core/sim/setpoint_flight.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/fly/flight_spec.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

/// Whose laws the gusts follow.
enum class Air { truth, model };

struct SimulateOptions {
  std::string map, model, vehicle, flight, setpoints, out;
  Air air = Air::truth;
  std::optional<std::uint64_t> seed;
  bool json = false, force = false;
};

/// A straight line that the vehicle cannot fly is an error of the specification.
void check_line(const SimulateOptions& options, const map::OccupancyGrid& grid, const map::DistanceField& distance,
                const Vehicle& vehicle, const Vec3& from, const Vec3& to) {
  const double length = (to - from).norm();
  const int steps = std::max(1, static_cast<int>(std::ceil(length / (0.5 * grid.resolution()))));
  for (int i = 0; i <= steps; ++i) {
    const Vec3 p = from + (to - from) * (static_cast<double>(i) / steps);
    if (distance.exact(grid, p) > vehicle.body.radius) continue;
    throw Failure(kBadData, options.flight + ":1: the line from " + to_text(from) + " to " + to_text(to) +
                                " meets an obstacle or unknown space at " + to_text(p) +
                                "; lead it around with further hover points");
  }
}

/// What `--flight` asks for, rest to rest on straight lines.
log::FlightLog fly_specified(const SimulateOptions& options, const map::OccupancyGrid& grid, const Vehicle& vehicle,
                             const sim::HoverFlight& spec, const sim::Simulation& simulation) {
  const map::DistanceField distance(grid);
  Vec3 at = spec.start_W;
  for (const auto& hover : spec.hovers) {
    check_line(options, grid, distance, vehicle, at, hover.p_W);
    at = hover.p_W;
  }
  progress("flying");
  return sim::to_log(sim::fly_hovers(grid, vehicle, spec, simulation), !simulation.terms.empty() || simulation.air);
}

/// The set-points of `--setpoints` again.
log::FlightLog fly_again(const SimulateOptions& options, const map::OccupancyGrid& grid, const Vehicle& vehicle,
                         std::uint64_t seed, const sim::Simulation& simulation) {
  const auto from = read_table(options.setpoints, "t_s");
  const auto flight = sim::logged_flight(from, vehicle, options.setpoints);
  if (!flight) throw Failure(kBadData, flight.error().message);
  progress("flying");
  return sim::to_log(sim::fly_setpoints(grid, vehicle, *flight, seed, simulation), *flight, from);
}

void check(const SimulateOptions& options) {
  if (options.flight.empty() == options.setpoints.empty()) throw Failure(kUsage, "give either --flight or --setpoints");
  if (options.air == Air::model && options.model.empty()) throw Failure(kUsage, "--air model needs --model");
  check_output(options.out, options.force);
}

int run(const SimulateOptions& options) {
  check(options);
  const auto vehicle = read_vehicle(options.vehicle);
  Model model;
  sim::Simulation simulation;
  if (!options.model.empty()) {
    model = read_model(options.model);
    model.ground.r0 = vehicle.body.diagonal_radius;
    simulation.terms = read_simulation(options.model);
  }
  std::optional<sim::HoverFlight> spec;
  if (!options.flight.empty()) spec = read_flight_spec(options.flight, options.seed);
  const auto grid = read_map(options.map);
  std::optional<sim::ModelField> field;
  if (options.air == Air::model) simulation.air = &field.emplace(grid, model);
  const std::uint64_t seed = spec ? spec->seed : options.seed.value_or(1);
  const auto log = spec ? fly_specified(options, grid, vehicle, *spec, simulation)
                        : fly_again(options, grid, vehicle, seed, simulation);
  write_log(options.out, log, options.force);
  const double time = log.t_s.back() - (spec ? 0 : log.t_s.front());
  if (options.json) {
    print(Json{{"log", options.out}, {"rows", log.t_s.size()}, {"time_s", time}, {"seed", seed}});
  } else {
    std::printf("%zu rows, %.2f s, written to %s\n", log.t_s.size(), time, options.out.c_str());
  }
  return kOk;
}

}  // namespace

Verb simulate_verb(Command& app) {
  auto options = std::make_shared<SimulateOptions>();
  auto& command = app.add_subcommand(
      "simulate", "Flight log of a simulated flight: between hover points, or the set-points of a log again");
  command.add_option("--map", options->map, "OctoMap file or builtin:NAME").required();
  command.add_option("--vehicle", options->vehicle, "vehicle file or builtin:NAME").required();
  command.add_option("--model", options->model,
                     "model file: what its extension says of vehicle, air and sensors is flown");
  const std::vector<std::pair<std::string, Air>> airs = {{"truth", Air::truth}, {"model", Air::model}};
  add_choice(command, "--air", options->air, airs, "gusts: the airflow truth's own laws, or those of --model")
      .default_str("truth");
  command.add_option("--flight", options->flight, "flight specification, TOML");
  command.add_option("--setpoints", options->setpoints, "flight log, CSV, whose set-points are flown again");
  command.add_option("--out", options->out, "flight log to write, CSV").required();
  command.add_option("--seed", options->seed, "in place of the specification's");
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.add_flag("--force", options->force, "overwrite --out");
  command.footer(
      "Example:\n  backwash simulate --map builtin:apartment --vehicle builtin:quad-5in --flight flight.toml --out "
      "log.csv\n"
      "where flight.toml holds\n  start = [1.5, 1.5, 1.0]\n  [[hover]]\n  p = [2.0, 1.5, 0.6]\n  dwell = 10.0\nWhat "
      "the simulation says of a "
      "flight that was measured:\n  backwash simulate --map room.bt --vehicle craft.toml --model extended.toml --air "
      "model \\\n    --setpoints measured.csv --out simulated.csv");
  return {&command, [options] { return run(*options); }};
}

}  // namespace backwash::services
