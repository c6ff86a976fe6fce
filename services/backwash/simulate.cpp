// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>

#include "core/map/distance_field.hpp"
#include "core/sim/flight.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/flight_spec.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

struct Options {
  std::string map, model, vehicle, flight, out;
  std::optional<std::uint64_t> seed;
  bool json = false, force = false;
};

/// A straight line that the vehicle cannot fly is an error of the specification.
void check_line(const Options& options, const map::OccupancyGrid& grid, const map::DistanceField& distance,
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

int run(const Options& options) {
  refuse_to_overwrite(options.out, options.force);
  const auto spec = read_flight_spec(options.flight, options.seed);
  const auto vehicle = read_vehicle(options.vehicle);
  if (!options.model.empty()) read_model(options.model);
  const auto grid = read_map(options.map);
  const map::DistanceField distance(grid);
  Vec3 at = spec.start_W;
  for (const auto& hover : spec.hovers) {
    check_line(options, grid, distance, vehicle, at, hover.p_W);
    at = hover.p_W;
  }
  progress("flying");
  const auto samples = sim::fly_hovers(grid, vehicle, spec);
  const auto written = log::write_csv(options.out, sim::to_log(samples), options.force);
  if (!written) throw Failure(kCannotCreate, written.error().message);
  if (options.json) {
    print(Json{{"log", options.out}, {"rows", samples.size()}, {"time_s", samples.back().t}, {"seed", spec.seed}});
  } else {
    std::printf("%zu rows, %.2f s, written to %s\n", samples.size(), samples.back().t, options.out.c_str());
  }
  return kOk;
}

}  // namespace

Verb simulate_verb(CLI::App& app) {
  auto options = std::make_shared<Options>();
  auto* command =
      app.add_subcommand("simulate", "Flight log of straight flights between hover points in simulated airflow");
  command->add_option("--map", options->map, "OctoMap file or builtin:NAME")->required();
  command->add_option("--vehicle", options->vehicle, "vehicle file or builtin:NAME")->required();
  command->add_option("--model", options->model, "model file: checked, not used; the airflow has its own laws");
  command->add_option("--flight", options->flight, "flight specification, TOML")->required();
  command->add_option("--out", options->out, "flight log to write, CSV")->required();
  command->add_option("--seed", options->seed, "in place of the specification's");
  command->add_flag("--json", options->json, "one JSON object on stdout");
  command->add_flag("--force", options->force, "overwrite --out");
  command->footer(
      "Example:\n  backwash simulate --map builtin:apartment --vehicle builtin:quad-5in --flight flight.toml --out "
      "log.csv\n"
      "where flight.toml holds\n  start = [1.5, 1.5, 1.0]\n  [[hover]]\n  p = [2.0, 1.5, 0.6]\n  dwell = 10.0");
  return {command, [options] { return run(*options); }};
}

}  // namespace backwash::services
