// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/bound/bound_field.hpp"
#include "core/reach/chance.hpp"
#include "core/reach/reach_tube.hpp"
#include "core/reach/response/integrator.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/site/world_cache.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

enum class Kind { tight, paper, chance };
const std::vector<std::pair<std::string, Kind>> kKinds = {
    {"tight", Kind::tight}, {"paper", Kind::paper}, {"chance", Kind::chance}};
const std::vector<std::pair<std::string, reach::Loop>> kLoops = {
    {"vehicle", reach::Loop::vehicle}, {"continuous", reach::Loop::continuous}, {"sampled", reach::Loop::sampled}};

struct ReachOptions {
  std::string vehicle, track, map, model;
  Kind kind = Kind::tight;
  std::optional<reach::Loop> loop;
  std::optional<double> probability;
  std::optional<Vec3> direction;
  bool json = false;
  /// Of the sets that are bounded or left; the chance is that of the exact supports.
  reach::Method method() const { return kind == Kind::paper ? reach::Method::paper : reach::Method::tight; }
};

const char* const kSigmaColumns[] = {"sigma_xx", "sigma_xy", "sigma_xz", "sigma_yy", "sigma_yz", "sigma_zz"};

/// Line of a row in the file (comment-free CSV: the names are line 1).
std::string at_row(const std::string& path, std::size_t row) {
  return path + ":" + std::to_string(row + 2) + ": row " + std::to_string(row + 1) + ": ";
}

void check_times(const std::string& path, const log::FlightLog& track) {
  if (track.t_s.empty()) throw Failure(kBadData, path + ":2: no rows; give one command per 20 ms");
  for (std::size_t i = 1; i < track.t_s.size(); ++i) {
    if (std::abs(track.t_s[i] - track.t_s[i - 1] - kControlPeriod) > 1e-4) {
      throw Failure(kBadData, at_row(path, i) + "t_s is " + to_text(track.t_s[i], 4) + " after " +
                                  to_text(track.t_s[i - 1], 4) + "; rows must be 0.02 s apart");
    }
  }
}

std::vector<Setpoint> read_commands(const std::string& path, const log::FlightLog& track) {
  for (const char* name : {"cmd_x_m", "cmd_y_m", "cmd_z_m"}) {
    if (!track.has(name))
      throw Failure(kBadData, path + ":1: no column '" + name + "'; commands need cmd_x_m,cmd_y_m,cmd_z_m");
  }
  const auto vector = [&](const std::string& unit, std::size_t row) {
    Vec3 value = Vec3::Zero();
    const std::string prefix = unit == "_m" ? "cmd_" : unit == "_mps" ? "cmd_v" : "cmd_a";
    for (int axis = 0; axis < 3; ++axis) {
      const std::string name = prefix + std::string("xyz")[static_cast<std::size_t>(axis)] + unit;
      if (track.has(name)) value[axis] = track.column(name)[row];
    }
    return value;
  };
  std::vector<Setpoint> commands;
  for (std::size_t i = 0; i < track.t_s.size(); ++i) {
    commands.push_back({vector("_m", i), vector("_mps", i), vector("_mps2", i), 0.0});
  }
  return commands;
}

bool has_variances(const std::string& path, const log::FlightLog& track) {
  const auto present = std::count_if(std::begin(kSigmaColumns), std::end(kSigmaColumns),
                                     [&](const char* name) { return track.has(name); });
  if (present != 0 && present != 6) {
    throw Failure(
        kBadData,
        path + ":1: some sigma columns are missing; give sigma_xx,sigma_xy,sigma_xz,sigma_yy,sigma_yz,sigma_zz");
  }
  return present == 6;
}

std::vector<Variance> read_variances(const std::string& path, const log::FlightLog& track) {
  std::vector<Variance> variances;
  for (std::size_t i = 0; i < track.t_s.size(); ++i) {
    double s[6];
    for (std::size_t n = 0; n < 6; ++n) s[n] = track.column(kSigmaColumns[n])[i];
    Mat3 sigma;
    sigma << s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5];
    const double smallest = Eigen::SelfAdjointEigenSolver<Mat3>(sigma, Eigen::EigenvaluesOnly).eigenvalues()[0];
    if (smallest < -1e-9 * sigma.cwiseAbs().maxCoeff()) {  // rounding of printed values
      throw Failure(kBadData, at_row(path, i) + "the variance has the eigenvalue " + to_text(smallest, 6) +
                                  "; it must be positive semidefinite");
    }
    variances.push_back(Variance{s[0], s[1], s[2], s[3], s[4], s[5]});
  }
  return variances;
}

const std::string& name_of(Kind kind) {
  return std::ranges::find(kKinds, kind, &std::pair<std::string, Kind>::second)->first;
}

reach::Loop read_loop(const ReachOptions& options) {
  if (options.kind == Kind::paper) {
    if (options.loop && options.loop != reach::Loop::continuous) {
      throw Failure(kUsage, "--method paper knows only --loop continuous; the second-order loop of the paper");
    }
    return reach::Loop::continuous;
  }
  if (options.kind == Kind::chance && options.loop == reach::Loop::sampled) {
    throw Failure(kUsage,
                  "--method chance knows --loop vehicle and continuous; sampled feedback has no covariance yet");
  }
  return options.loop.value_or(reach::Loop::vehicle);
}

void check_probability(const ReachOptions& options) {
  if (options.kind != Kind::chance) {
    if (options.probability)
      throw Failure(kUsage, "--probability belongs to --method chance; the others bound the worst case");
    return;
  }
  if (!options.probability || !(*options.probability > 0) || !(*options.probability < 1)) {
    throw Failure(kUsage,
                  "--method chance needs --probability, of leaving the sets per second of flight, above 0 and below 1, "
                  "such as 1e-3");
  }
}

/// A tube, and the levels of its seconds where the method is chance.
reach::ChanceTube tube(const ReachOptions& options, const reach::Reachability& reach) {
  const auto track = read_table(options.track, "t_s");
  check_times(options.track, track);
  const auto commands = read_commands(options.track, track);
  const State start{commands[0].p_W, commands[0].v_W};
  const bool chance = options.kind == Kind::chance;
  if (chance && reach::has_integrator(reach.vehicle))
    throw Failure(kConfiguration, options.vehicle +
                                      ":1: controller.velocity_integrator: --method chance does not know it; leave "
                                      "it out or ask for --method tight");
  if (has_variances(options.track, track)) {
    if (!options.map.empty()) throw Failure(kUsage, "the track has sigma columns; give either those or --map");
    const BoundModel model = options.model.empty() ? BoundModel{} : read_model(options.model).bound;
    const auto sigma = read_variances(options.track, track);
    if (chance)
      return chance_tube_with_variances(reach, start, commands[0], commands, sigma, model, *options.probability);
    std::vector<DisturbanceBound> bounds;
    bounds.reserve(sigma.size());
    reach::FieldExtremes most;
    most.level = model.mean_horizontal;
    most.vertical = model.mean_vertical;
    for (const Variance& s : sigma) {
      bounds.push_back(bound(s, model));
      for (std::size_t d = 0; d < kDirections; ++d) {
        const double mean = d == kZ ? model.mean_vertical : model.mean_horizontal;
        most.gusts.w[d] = std::max(most.gusts.w[d], bounds.back().w[d] - mean);
      }
    }
    // A loop with an integrator holds what blew before: of a track, its own largest.
    const reach::NetDisturbance net(reach, most, model);
    for (DisturbanceBound& b : bounds) b = net(b);
    return {tube_with_bounds(reach, start, commands[0], commands, bounds), {}};
  }
  if (options.map.empty() || options.model.empty()) {
    throw Failure(kUsage, "the track has no sigma columns; add them or give --map and --model");
  }
  const Model model = read_model(options.model);
  if (chance && model.bound.kappa == 0)
    throw Failure(kConfiguration, options.model + ":1: --method chance over a map needs bound.kappa above 0");
  const auto world =
      world_of({read_map(options.map), model, options.model, reach.vehicle, options.vehicle, reach.method});
  if (chance) {
    return chance_tube_over_field(reach, start, commands[0], commands, world->bounds, model.bound,
                                  *options.probability);
  }
  return {tube_over_field(reach, start, commands[0], commands, world->bounds), {}};
}

void print_table(const reach::ReachTube& tube, const ReachOptions& options) {
  if (options.probability) {
    std::printf("left with at most %g per second of flight, for Gaussian disturbances: no worst case\n",
                *options.probability);
  }
  std::printf("%8s %9s %9s %9s   %8s %8s %8s %8s %8s %8s   half widths in m\n", "t_s", "x_m", "y_m", "z_m", "x", "y",
              "z", "xy_plus", "xy_minus", "r_max");
  for (const auto& step : tube) {
    const auto& p = step.center.p_W;
    const auto& h = step.half_widths;
    std::printf("%8.3f %9.4f %9.4f %9.4f   %8.5f %8.5f %8.5f %8.5f %8.5f %8.5f", step.t, p.x(), p.y(), p.z(), h[kX],
                h[kY], h[kZ], h[kXyPlus], h[kXyMinus], step.r_max);
    if (options.direction) std::printf("   support %8.5f", support(step, options.method(), *options.direction));
    std::printf("\n");
  }
}

int run(ReachOptions options) {
  if (options.direction) {
    if (options.direction->norm() == 0) throw Failure(kUsage, "--direction: 0,0,0 has no direction; give another");
    options.direction->normalize();
  }
  check_probability(options);
  const auto reach =
      read_reachability(read_vehicle(options.vehicle), options.method(), read_loop(options), options.vehicle);
  const auto [steps, levels] = tube(options, reach);
  if (!options.json) {
    print_table(steps, options);
    return kOk;
  }
  Json json = {{"method", name_of(options.kind)}};
  if (options.probability) {
    json["probability"] = *options.probability;
    json["levels"] = Json::array();
    for (const PerDirection& level : levels) json["levels"].push_back(services::to_json(level));
  }
  json["steps"] = services::to_json(steps, options.method(), options.direction);
  print(json);
  return kOk;
}

}  // namespace

Verb reach_verb(Command& app) {
  auto options = std::make_shared<ReachOptions>();
  auto& command = app.add_subcommand("reach", "Reachable sets of the position error along a track of commands");
  command.add_option("--vehicle", options->vehicle, "vehicle file or builtin:NAME").required();
  command.add_option("--track", options->track, "CSV: t_s, cmd_x_m … cmd_az_mps2, and sigma_xx … sigma_zz or --map")
      .required();
  add_choice(command, "--method", options->kind, kKinds,
             "tight (default): exact supports; paper: ellipsoids; chance: left with --probability, no worst case");
  command.add_option("--probability", options->probability, "chance only: of leaving the sets, per second of flight");
  add_choice(command, "--loop", options->loop, kLoops, "vehicle (default), continuous (always with paper) or sampled");
  command.add_option("--map", options->map, "OctoMap file or builtin:NAME, for tracks without sigma columns");
  command.add_option("--model", options->model, "model file or builtin:NAME: its bound, and its field with --map");
  add_point(command, "--direction", options->direction, "also the support along this direction");
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.footer("Example:\n  backwash reach --vehicle builtin:quad-5in --track track.csv --method paper --json");
  return {&command, [options] { return run(*options); }};
}

}  // namespace backwash::services
