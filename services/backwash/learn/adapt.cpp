// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>

#include "core/config/config.hpp"
#include "core/types/time.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/learn/adapt_flight.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

struct AdaptOptions {
  std::vector<std::string> logs;
  std::string map, model = "builtin:quad-5in", vehicle;
  bool json = false;
};

struct Learned {
  FlownAir flown;
  adapt::InFlight air;
  Json rises = Json::array();  // when each factor rose
};

/// What calibration says of the gusts: the interval of τ_w where the model file has one, else τ_w itself.
adapt::Gusts gusts_of(const AdaptOptions& options, const Model& model) {
  const auto interval = config::load_tau_interval(options.model);
  if (!interval) throw Failure(kConfiguration, interval.error().message);
  return {(*interval)[0], (*interval)[1], model.bound.mean_horizontal, model.bound.mean_vertical};
}

Learned learn(FlownAir flown, const adapt::InFlightConstants& constants) {
  Learned learned{std::move(flown), adapt::InFlight(constants)};
  AirFactors before = learned.air.factors();
  for (const auto& tick : learned.flown.ticks) {
    if (!learned.air.add(tick)) continue;
    for (std::size_t c = 0; c < kAirClasses; ++c) {
      const auto air = static_cast<AirClass>(c);
      const double factor = learned.air.factors()[c];
      if (!(factor > before[c])) continue;
      before[c] = factor;
      learned.rises.push_back({{"t_s", seconds(tick.now_ns)},
                               {"class", to_string(air)},
                               {"factor", factor},
                               {"ln_evidence", learned.air.ln_evidence(air)},
                               {"ln_changed", learned.air.ln_changed(air)}});
    }
  }
  return learned;
}

Json to_json(const Learned& learned, const std::string& path) {
  Json classes = Json::array();
  for (std::size_t c = 0; c < kAirClasses; ++c) {
    const auto air = static_cast<AirClass>(c);
    const auto& bets = learned.air.of(air);
    if (!(bets.seconds() > 0)) continue;
    classes.push_back({{"class", to_string(air)},
                       {"seconds", bets.seconds()},
                       {"factor", learned.air.factors()[c]},
                       {"at_least", learned.air.factors()[c] >= adapt::Bets::kRougher.back()},
                       {"ln_evidence", learned.air.ln_evidence(air)},
                       {"ln_changed", learned.air.ln_changed(air)},
                       {"rougher", learned.air.above(air).has_value()},
                       {"cause", to_string(learned.air.cause(air))},
                       {"beyond", bets.beyond()},
                       {"beyond_promised", bets.promised_beyond()},
                       {"calmer", bets.below() ? Json(*bets.below()) : Json()}});
  }
  return {{"log", path},
          {"samples", learned.flown.rows},
          {"left_out", learned.flown.left_out},
          {"attitude", learned.flown.attitude},
          {"accelerometer", learned.flown.accelerometer},
          {"noise", services::to_json(learned.air.noise())},
          {"every_s", learned.air.spacing_s()},
          {"classes", classes},
          {"rises", learned.rises}};
}

void print_text(const Learned& learned, const std::string& path) {
  const Vec3 noise = 1000 * learned.air.noise().cwiseSqrt();
  std::printf("%s: %zu samples, %zu rows left out%s; an error each %.2f s, noise of the position %.1f, %.1f, %.1f mm\n",
              path.c_str(), learned.flown.rows, learned.flown.left_out,
              learned.flown.attitude ? "" : "; no attitude, so no class", learned.air.spacing_s(), noise.x(), noise.y(),
              noise.z());
  for (std::size_t c = 0; c < kAirClasses; ++c) {
    const auto air = static_cast<AirClass>(c);
    const auto& bets = learned.air.of(air);
    if (!(bets.seconds() > 0)) continue;
    const double factor = learned.air.factors()[c];
    std::printf("  %-9s %7.1f s  factor %s%.2f  ln evidence %.1f, of a change %.1f\n", to_string(air), bets.seconds(),
                factor >= adapt::Bets::kRougher.back() ? "at least " : "", factor, learned.air.ln_evidence(air),
                learned.air.ln_changed(air));
    std::printf("    errors beyond the level of 1e-2 a sample: %d where %.1f were promised", bets.beyond(),
                bets.promised_beyond());
    if (learned.air.above(air)) std::printf("; rougher than promised: %s", adapt::explained(learned.air.cause(air)));
    if (bets.below()) std::printf("; calmer: below %.2f", *bets.below());
    std::printf("\n");
    for (const auto& rise : learned.rises)
      if (rise["class"] == to_string(air))
        std::printf("    %9.2f s  %5.2f\n", rise["t_s"].get<double>(), rise["factor"].get<double>());
  }
}

int run(const AdaptOptions& options) {
  if (options.vehicle.empty() || options.logs.empty()) throw Failure(kUsage, "adapt needs logs and --vehicle");
  const auto vehicle = read_vehicle(options.vehicle);
  auto model = read_model(options.model);
  model.ground.r0 = vehicle.body.diagonal_radius;
  if (!model.extension.empty())
    throw Failure(
        kConfiguration,
        options.model + ":1: is an extended model, whose factors are not evaluated here; give the one before");
  const auto room = options.map.empty() ? std::nullopt : std::optional(read_map(options.map));
  adapt::InFlightConstants constants;
  constants.controller = vehicle.controller;
  constants.gusts = gusts_of(options, model);
  const auto& gusts = constants.gusts;
  Json json{{"tau_s", {gusts.tau_low_s, gusts.tau_high_s}}, {"gusts", "any"}, {"alpha", constants.alpha}};
  json["logs"] = Json::array();
  for (const auto& path : options.logs) {
    progress("reading " + path);
    const auto learned = learn(read_air(path, vehicle, model, room ? &*room : nullptr), constants);
    options.json ? json["logs"].push_back(to_json(learned, path)) : print_text(learned, path);
  }
  if (options.json) print(json);
  return kOk;
}

}  // namespace

Verb adapt_verb(Command& app) {
  auto options = std::make_shared<AdaptOptions>();
  auto& command = app.add_subcommand(
      "adapt",
      "By how much a flight's errors were larger than promised, by class of air, as it would be known in flight");
  command.add_option("logs", options->logs, "flight logs: CSV, PX4 (.ulg), ArduPilot (.bin) or the daemon's (.mcap)");
  command.add_option("--vehicle", options->vehicle, "vehicle file or builtin:NAME: gains, delays, r0");
  command.add_option("--map", options->map,
                     "OctoMap file or builtin:NAME; without one, no surface but the floor z = 0");
  command.add_option("--model", options->model, "model file or builtin:NAME").capture_default_str();
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.footer(
      "Example:\n  backwash adapt flight*.csv --map room.bt --model builtin:quad-5in --vehicle builtin:quad-5in");
  return {&command, [options] { return run(*options); }};
}

}  // namespace backwash::services
