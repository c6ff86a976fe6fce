// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "core/study/calibrate/model_text.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/learn/calibrate_input.hpp"
#include "services/backwash/learn/calibrate_page.hpp"
#include "services/backwash/verb.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

using namespace study::calibrate;

struct CalibrateOptions {
  CampaignFiles files;
  std::string vehicle, base_model = "builtin:quad-5in", out, report;
  double quantile = 0.9;
  std::uint64_t seed = 1;
  int bootstraps = 200;
  bool keep_base = false, judge = false, json = false, force = false;
};

Json to_json(const Interval& i) { return {i.low, i.high}; }
Json to_json(const CalibratedValue& e) { return {{"value", e.value}, {"ci95", to_json(e.ci95)}}; }
Json axes_to_json(const Vec3& v) { return {{"x", v.x()}, {"y", v.y()}, {"z", v.z()}}; }

Json to_json(const std::vector<Bin>& bins) {
  Json all = Json::array();
  for (const auto& bin : bins)
    all.push_back({{"low_m", bin.low},
                   {"high_m", std::isfinite(bin.high) ? Json(bin.high) : Json()},
                   {"windows", bin.windows},
                   {"coverage", axes_to_json(bin.coverage)}});
  return all;
}

Json to_json(const Assessment& a, const std::vector<std::string>& logs) {
  Json flights = Json::array();
  for (std::size_t f = 0; f < logs.size(); ++f)
    flights.push_back(
        {{"log", logs[f]}, {"windows", a.flight_windows[f]}, {"coverage", axes_to_json(a.flight_coverage[f])}});
  return {{"windows", a.windows},
          {"coverage", axes_to_json(a.coverage)},
          {"bound_over_observed", axes_to_json(a.bound_over_observed)},
          {"pinball_loss", a.loss},
          {"pinball_loss_constant", a.constant_loss},
          {"pinball_loss_height_only", a.height_loss},
          {"by_wall_distance", to_json(a.by_wall_distance)},
          {"by_height", to_json(a.by_height)},
          {"flights", std::move(flights)}};
}

Json to_json(const std::vector<Refusal>& refused) {
  Json all = Json::array();
  for (const auto& r : refused) {
    Json keys = Json::array();
    for (const auto p : r.parameters) keys.push_back(std::string(key(p)));
    all.push_back({{"what", r.what}, {"parameters", keys}, {"why", r.why}, {"flight", r.flight}});
  }
  return all;
}

Json to_json(const Campaign& campaign, const CalibrateOptions& options) {
  Json gated, signals = Json::array();
  for (std::size_t g = 0; g < study::kHoverGates; ++g)
    gated[study::to_string(static_cast<study::Gate>(g))] = campaign.gated[g];
  Json json{{"quantile", options.quantile}, {"flights", campaign.logs.size()}, {"windows", campaign.windows}};
  json["gated_out"] = gated;
  json["signal"] = campaign.signal;
  json["not_tested"] = campaign.not_tested;
  if (campaign.height) {
    const auto& h = *campaign.height;
    json["height_effect"] = {
        {"low_m", h.low_m},     {"high_m", h.high_m},   {"variance_ratio_z", to_json(h.low_over_high)},
        {"windows", h.windows}, {"flights", h.flights}, {"days", h.days}};
    if (h.ceiling)
      json["lacking"] = Json::array({{{"name", "ceiling"},
                                      {"why", "the model has no term for a surface above the vehicle"},
                                      {"variance_ratio_z", to_json(*h.ceiling)}}});
  }
  return json;
}

void add(Json& json, const Calibration& c, const Campaign& campaign) {
  Json parameters;
  for (std::size_t p = 0; p < kParameters; ++p) {
    if (c.determined[p])
      parameters[std::string(key(static_cast<Parameter>(p)))] = {{"value", c.fitted.parameters[p]},
                                                                 {"ci95", to_json(c.ci95[p])}};
  }
  json["parameters"] = parameters;
  json["bound"] = {{"tau_w", to_json(c.tau_w)}};
  if (c.push)
    json["bound"]["mean"] = {{"horizontal", to_json(c.push->horizontal)}, {"vertical", to_json(c.push->vertical)}};
  json["between_flights_sd"] = {{"horizontal", c.fitted.between_sd[0]}, {"vertical", c.fitted.between_sd[1]}};
  json["within_flight_sd"] = {{"horizontal", c.fitted.within_sd[0]}, {"vertical", c.fitted.within_sd[1]}};
  json["held_out"] = to_json(c.held_out, campaign.logs);
  json["fitted"] = to_json(c.on_fitted, campaign.logs);
}

void print_text(const Calibration& c, const CalibrateOptions& options) {
  std::printf("%-26s %10s   95 %% interval\n", "constant", "value");
  for (std::size_t p = 0; p < kParameters; ++p) {
    if (c.determined[p])
      std::printf("%-26s %10.4g   %.4g … %.4g\n", key(static_cast<Parameter>(p)).data(), c.fitted.parameters[p],
                  c.ci95[p].low, c.ci95[p].high);
  }
  const auto& h = c.held_out;
  std::printf("held out by flight, asked %.2f: coverage x %.3f y %.3f z %.3f, bound over observed %.2f %.2f %.2f\n",
              options.quantile, h.coverage.x(), h.coverage.y(), h.coverage.z(), h.bound_over_observed.x(),
              h.bound_over_observed.y(), h.bound_over_observed.z());
  std::printf("pinball loss %.4f: %.0f %% below the best constant bound, %.0f %% below the best bound by height\n",
              h.loss, 100 * (1 - h.loss / h.constant_loss), 100 * (1 - h.loss / h.height_loss));
  if (!options.out.empty()) std::printf("model written to %s\n", options.out.c_str());
}

/// What cannot be determined, one line for the end of the program.
std::string refusal_line(const std::vector<Refusal>& refused) {
  std::string line;
  for (const auto& r : refused)
    line += (line.empty() ? "" : "; ") + r.what + " refused: " + r.why + "; to determine it, " + r.flight;
  return line;
}

/// The base model against the logs, nothing fitted.
int judge(const Campaign& campaign, const Model& model, const CalibrateOptions& options, Json json) {
  const auto judged = assess(campaign.data, ln_bounds(campaign.data, parameters_of(model)), options.quantile);
  if (options.json) {
    json["judged"] = to_json(judged, campaign.logs);
    print(told_first(campaign.notes, json));
  } else {
    const Vec3& c = judged.coverage;
    print_text(campaign.notes);
    std::printf("%zu windows, share below %s: x %.3f y %.3f z %.3f\n", judged.windows, options.base_model.c_str(),
                c.x(), c.y(), c.z());
  }
  return kOk;
}

void check(const CalibrateOptions& options) {
  if (options.files.logs.empty()) throw Failure(kUsage, "calibrate needs --log");
  if (options.judge && !(options.out.empty() && options.report.empty()))
    throw Failure(kUsage, "--judge fits nothing that --out or --report could hold; give it without them");
  check_outputs({options.out, options.report}, options.force);
}

Campaign campaign_of(const CalibrateOptions& options, const std::optional<Vehicle>& vehicle, const Model& gates) {
  Campaign campaign = empty_campaign(options.files);
  std::vector<CalibratedLog> logs;
  campaign.notes.verb = "backwash calibrate";
  read_logs(options.files, campaign.maps, vehicle, gates, campaign.notes,
            [&](CalibratedLog&& log) { logs.push_back(std::move(log)); });
  add_logs(campaign, std::move(logs), options.seed);
  return campaign;
}

int run(const CalibrateOptions& options) {
  check(options);
  std::optional<Vehicle> vehicle;
  if (!options.vehicle.empty()) vehicle = read_vehicle(options.vehicle);
  auto gates = read_model(options.base_model);
  if (vehicle) gates.ground.r0 = vehicle->body.diagonal_radius;
  const auto campaign = campaign_of(options, vehicle, gates);
  Json json = to_json(campaign, options);
  if (options.judge) return judge(campaign, gates, options, std::move(json));
  const auto refused = refusals(campaign.data, gates);
  json["refused"] = to_json(refused);
  const bool nothing = !refused.empty() && refused.front().of_everything();
  if (nothing || (!refused.empty() && !options.keep_base)) {
    if (options.json) print(told_first(campaign.notes, json));
    throw Failure(kBadData, refusal_line(refused) +
                                (nothing ? "" : "; or give --keep-base to take these constants from the base model"));
  }
  progress("fitting " + std::to_string(campaign.windows) + " windows");
  study::calibrate::Options how;
  how.fit.quantile = options.quantile;
  how.seed = options.seed;
  how.bootstraps = options.bootstraps;
  how.progress = [](std::size_t done, std::size_t of) { progress(done, of); };
  const auto calibration = calibrate(campaign.data, gates, refused, campaign.pushes, how);
  const Provenance provenance{kVersion,      options.vehicle,    options.base_model, campaign.map_names,
                              campaign.logs, campaign.signal,    campaign.windows,   campaign.gated,
                              options.seed,  options.bootstraps, options.quantile};
  if (!options.out.empty()) write_file(options.out, model_text(calibration, provenance), options.force, model_refusal);
  if (!options.report.empty())
    write_file(options.report,
               calibrate_page(calibration, campaign, refused, {options.quantile, options.vehicle, options.base_model}),
               options.force);
  if (options.json) {
    add(json, calibration, campaign);
    if (!options.out.empty()) json["model"] = options.out;
    print(told_first(campaign.notes, json));
  } else {
    print_text(campaign.notes);
    print_text(calibration, options);
    if (!refused.empty()) std::printf("kept from the base model: %s\n", refusal_line(refused).c_str());
  }
  return kOk;
}

}  // namespace

Verb calibrate_verb(Command& app) {
  auto options = std::make_shared<CalibrateOptions>();
  auto& command =
      app.add_subcommand("calibrate", "Model file from hover flights: a bound at a quantile, with intervals");
  add_campaign_options(command, options->files);
  command.add_option("--vehicle", options->vehicle, "vehicle file or builtin:NAME: gains, delays, r0");
  command.add_option("--base-model", options->base_model, "model whose gates and kappa are kept").capture_default_str();
  command.add_option("--quantile", options->quantile, "share of windows that the bound shall hold")
      .check(within(0.5, 0.99))
      .capture_default_str();
  command.add_option("--out", options->out, "model file to write, TOML");
  command.add_option("--report", options->report, "HTML page with the raw variances under the bound");
  command.add_option("--bootstraps", options->bootstraps, "refits for the intervals")
      .check(within(20, 10000))
      .capture_default_str();
  command.add_option("--seed", options->seed, "of the bootstrap").capture_default_str();
  command.add_flag("--keep-base", options->keep_base,
                   "constants that the flights cannot determine stay the base model's, named in [provenance]");
  command.add_flag("--judge", options->judge, "fit nothing: how the base model does on these logs");
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.add_flag("--force", options->force, "overwrite --out and --report");
  command.footer(
      "Each --log belongs to the --map before it (or the only one); without a map, to a flat floor.\nExample:\n"
      "  backwash calibrate --map builtin:parallel-walls-2m --log a.csv b.csv --map builtin:parallel-walls-1m --log "
      "c.csv "
      "d.csv --vehicle builtin:quad-5in --out model.toml");
  return {&command, [options] { return run(*options); }};
}

}  // namespace backwash::services
