// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>
#include <tuple>

#include "core/config/config.hpp"
#include "services/backwash/adapt_flight.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

struct AdaptOptions {
  std::vector<std::string> logs;
  std::string map, model = "builtin:quad-5in", vehicle, gusts = "any";
  bool json = false;
};

/// When a class's factor rose.
struct Rise {
  double t_s;
  AirClass air;
  double factor, ln_evidence, ln_changed;
};
struct Learned {
  FlownAir air;
  adapt::Adaptation adaptation;
  std::vector<Rise> rises;
};

constexpr const char* kForms[] = {"karman", "first_order", "second_order"};

/// What calibration says of the gusts: the interval of τ_w where the model file has one, else τ_w itself.
adapt::Gusts gusts_of(const AdaptOptions& options, const Model& model) {
  adapt::Gusts gusts;
  gusts.mean_horizontal = model.bound.mean_horizontal, gusts.mean_vertical = model.bound.mean_vertical;
  for (std::size_t k = 0; k < std::size(kForms); ++k)
    if (options.gusts == kForms[k]) gusts.form = static_cast<adapt::GustForm>(k);
  const auto interval = config::load_tau_interval(options.model);
  if (!interval) throw Failure(kConfiguration, interval.error().message);
  std::tie(gusts.tau_low_s, gusts.tau_high_s) = std::tuple((*interval)[0], (*interval)[1]);
  return gusts;
}

Learned learn(FlownAir air, adapt::Gusts gusts) {
  gusts.noise = air.noise;
  Learned learned{std::move(air), adapt::Adaptation(gusts), {}};
  std::array<double, kAirClasses> before;
  before.fill(1);
  for (const auto& sample : learned.air.samples) {
    if (!learned.adaptation.add(sample)) continue;
    for (std::size_t c = 0; c < kAirClasses; ++c) {
      const auto air_class = static_cast<AirClass>(c);
      const auto& bets = learned.adaptation.of(air_class);
      const double factor = learned.adaptation.factor(air_class);
      if (!(factor > before[c])) continue;
      before[c] = factor;
      learned.rises.push_back({sample.t_s, air_class, factor, bets.ln_evidence(), bets.ln_changed()});
    }
  }
  return learned;
}

Json to_json(const Learned& learned, const std::string& path) {
  Json classes = Json::array(), rises = Json::array();
  for (std::size_t c = 0; c < kAirClasses; ++c) {
    const auto air = static_cast<AirClass>(c);
    const auto& bets = learned.adaptation.of(air);
    if (!(bets.seconds() > 0)) continue;
    classes.push_back({{"class", to_string(air)},
                       {"seconds", bets.seconds()},
                       {"factor", learned.adaptation.factor(air)},
                       {"ln_evidence", bets.ln_evidence()},
                       {"ln_changed", bets.ln_changed()},
                       {"rougher", bets.above().has_value()},
                       {"calmer", bets.below() ? Json(*bets.below()) : Json()}});
  }
  for (const auto& rise : learned.rises)
    rises.push_back({{"t_s", rise.t_s},
                     {"class", to_string(rise.air)},
                     {"factor", rise.factor},
                     {"ln_evidence", rise.ln_evidence},
                     {"ln_changed", rise.ln_changed}});
  return {{"log", path},
          {"samples", learned.air.samples.size()},
          {"left_out", learned.air.left_out},
          {"attitude", learned.air.attitude},
          {"accelerometer", learned.air.accelerometer},
          {"noise", services::to_json(learned.air.noise)},
          {"classes", classes},
          {"rises", rises}};
}

void print_text(const Learned& learned, const std::string& path) {
  std::printf("%s: %zu samples, %zu rows left out%s%s\n", path.c_str(), learned.air.samples.size(),
              learned.air.left_out, learned.air.attitude ? "" : "; no attitude, so no class",
              learned.air.accelerometer ? "" : "; acceleration by differences of the velocity");
  for (std::size_t c = 0; c < kAirClasses; ++c) {
    const auto air = static_cast<AirClass>(c);
    const auto& bets = learned.adaptation.of(air);
    if (!(bets.seconds() > 0)) continue;
    std::printf("  %-9s %7.1f s  factor %5.2f  ln evidence %6.1f, of a change %6.1f", to_string(air), bets.seconds(),
                learned.adaptation.factor(air), bets.ln_evidence(), bets.ln_changed());
    if (bets.above()) std::printf("  rougher than modelled");
    if (bets.below()) std::printf("  calmer: below %.2f", *bets.below());
    std::printf("\n");
    for (const auto& rise : learned.rises)
      if (rise.air == air) std::printf("    %9.2f s  %5.2f\n", rise.t_s, rise.factor);
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
  const auto gusts = gusts_of(options, model);
  Json json{{"tau_s", {gusts.tau_low_s, gusts.tau_high_s}}, {"gusts", options.gusts}, {"alpha", adapt::kAlpha}};
  json["logs"] = Json::array();
  for (const auto& path : options.logs) {
    progress("reading " + path);
    const auto learned = learn(read_air(path, vehicle, model, room ? &*room : nullptr), gusts);
    options.json ? json["logs"].push_back(to_json(learned, path)) : print_text(learned, path);
  }
  if (options.json) print(json);
  return kOk;
}

}  // namespace

Verb adapt_verb(Command& app) {
  auto options = std::make_shared<AdaptOptions>();
  auto& command = app.add_subcommand(
      "adapt", "How much rougher than modelled a flight's air was, by class, as it would be known in flight");
  command.add_option("logs", options->logs, "flight logs: CSV, PX4 (.ulg), ArduPilot (.bin) or the daemon's (.bwlog)");
  command.add_option("--vehicle", options->vehicle, "vehicle file or builtin:NAME: gains, delays, r0");
  command.add_option("--map", options->map,
                     "OctoMap file or builtin:NAME; without one, no surface but the floor z = 0");
  command.add_option("--model", options->model, "model file or builtin:NAME").capture_default_str();
  command.add_option("--gusts", options->gusts, "form of the gusts, if calibration told it")
      .check(one_of({"any", "karman", "first_order", "second_order"}))
      .capture_default_str();
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.footer(
      "Example:\n  backwash adapt flight*.csv --map room.bt --model builtin:quad-5in --vehicle builtin:quad-5in");
  return {&command, [options] { return run(*options); }};
}

}  // namespace backwash::services
