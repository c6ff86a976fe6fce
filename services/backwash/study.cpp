// SPDX-License-Identifier: BSD-3-Clause
#include <toml++/toml.h>
#include <cstdio>
#include <optional>

#include "core/study/discrepancy/extend.hpp"
#include "core/study/discrepancy/page.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/verb.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

namespace discrepancy = study::discrepancy;

struct Options {
  std::string map, model = "builtin:quad-5in", vehicle, report, out;
  std::vector<std::string> logs;
  unsigned seed = 1;
  bool json = false, force = false, quick = false;
};

Json to_json(const discrepancy::NamedCause& cause) {
  const auto& found = cause.found;
  Json parameters = Json::object();
  for (const auto& e : found.parameters) parameters[e.name] = {{"value", e.value}, {"ci95", {e.low, e.high}}};
  Json set = Json::array({found.form->cause});
  for (const auto& rival : found.rivals) set.push_back(rival.name);
  Json separate = Json::array();
  for (const auto& s : cause.separate_by)
    separate.push_back({{"rival", s.rival},
                        {"manoeuvre", s.manoeuvre},
                        {"expected_nats", s.expected_nats ? Json(*s.expected_nats) : Json(nullptr)}});
  const auto& g = cause.gain;
  return {{"name", found.form->cause},
          {"set", set},
          {"p", found.p},
          {"form", found.form->formula},
          {"parameters", parameters},
          {"gain",
           {{"held_out_nats", g.held_out_nats},
            {"ci95_nats", {g.low_nats, g.high_nats}},
            {"rmse_before", g.rmse_before},
            {"rmse_after", g.rmse_after},
            {"variance_coverage_before", g.coverage_before},
            {"variance_coverage_after", g.coverage_after}}},
          {"separate_by", separate}};
}

Json to_json(const discrepancy::StudyResult& result, const discrepancy::Observations& seen) {
  Json json = {{"verdict", discrepancy::to_string(result.verdict)},
               {"flights", seen.flights},
               {"windows", seen.windows.size()},
               {"gated_out", Json::object()},
               {"causes", Json::array()},
               {"unknown", Json::array()},
               {"not_tested", Json::array()},
               {"minimum_detectable", Json::object()}};
  for (const auto& [gate, count] : seen.gated_out) json["gated_out"][gate] = count;
  for (const auto& cause : result.causes) json["causes"].push_back(to_json(cause));
  for (const auto& u : result.unknown)
    json["unknown"].push_back({{"along", u.along}, {"of", u.group}, {"p", u.p}, {"held_out_nats", u.gain}});
  for (const auto& [name, why] : result.not_tested) json["not_tested"].push_back({{"name", name}, {"why", why}});
  for (const auto& [cause, sizes] : result.minimum_detectable)
    for (const auto& [parameter, size] : sizes) json["minimum_detectable"][cause][parameter] = size;
  json["threshold_nats"] = result.threshold;
  return json;
}

void print_text(const discrepancy::StudyResult& result, const discrepancy::Observations& seen) {
  std::printf("%s: %zu flights, %zu windows\n", discrepancy::to_string(result.verdict), seen.flights,
              seen.windows.size());
  if (result.verdict == discrepancy::Verdict::insufficient)
    std::printf("fewer than 10 flights with good windows do not warrant a name; fly more\n");
  for (const auto& cause : result.causes) {
    std::printf("%s: %s\n  p %.4f, held-out gain %.1f nats\n", cause.found.form->cause.c_str(),
                cause.found.form->formula.c_str(), cause.found.p, cause.gain.held_out_nats);
    for (const auto& e : cause.found.parameters)
      std::printf("  %s %.4g [%.4g, %.4g]\n", e.name.c_str(), e.value, e.low, e.high);
    for (const auto& s : cause.separate_by) {
      std::printf("  not told from %s; fly: %s", s.rival.c_str(), s.manoeuvre.c_str());
      std::printf(s.expected_nats ? " (%.1f nats expected)\n" : "\n", s.expected_nats.value_or(0));
    }
  }
  for (const auto& u : result.unknown)
    std::printf("unknown structure in %s along %s, p %.4f\n", u.group.c_str(), u.along.c_str(), u.p);
  for (const auto& [name, why] : result.not_tested) std::printf("not tested: %s (%s)\n", name.c_str(), why.c_str());
}

/// The study's own terms of a model file that it has extended before; none in others.
std::vector<discrepancy::Term> read_terms(const std::string& path) {
  std::vector<discrepancy::Term> terms;
  if (path.starts_with("builtin:")) return terms;
  const auto file = toml::parse_file(path);  // load_model has accepted it
  const auto* list = file.at_path("extension.term").as_array();
  if (!list) return terms;
  for (const auto& entry : *list) {
    const auto* table = entry.as_table();
    if (!table) continue;
    discrepancy::Term term{(*table)["cause"].value_or(std::string()),
                           (*table)["form"].value_or(std::string()),
                           (*table)["scale"].value_or(0.0),
                           {}};
    if (const auto* theta = (*table)["theta"].as_array())
      for (const auto& value : *theta) term.theta.push_back(value.value_or(0.0));
    terms.push_back(std::move(term));
  }
  return terms;
}

int run(const Options& options) {
  refuse_to_overwrite(options.report, options.force);
  refuse_to_overwrite(options.out, options.force);
  const auto vehicle = read_vehicle(options.vehicle);
  auto model = read_model(options.model);
  model.ground.r0 = vehicle.body.diagonal_radius;
  std::optional<map::OccupancyGrid> grid;
  if (!options.map.empty()) grid = read_map(options.map);
  discrepancy::Observer observer(vehicle, model, grid ? &*grid : nullptr);
  for (const auto& path : options.logs) {
    progress("reading " + path);
    const auto log = read_table(path, "t_s");
    for (const char* name : {"x_m", "y_m", "z_m"})
      if (!log.has(name))
        throw Failure(kBadData, path + ":1: no column '" + name + "'; a study needs positions x_m, y_m, z_m");
    observer.add(log);
  }
  auto seen = observer.finish();
  const auto left = discrepancy::apply(read_terms(options.model), seen);
  discrepancy::StudyOptions study_options;
  study_options.search.seed = options.seed;
  study_options.search.progress = [](const std::string& line) { progress(line); };
  study_options.minimum_detectable = !options.quick;
  const auto result = discrepancy::study(seen, study_options);
  Json json = to_json(result, seen);
  if (!left.empty())
    for (const auto& term : left) json["not_applied"].push_back({{"name", term.cause}, {"form", term.formula}});
  if (!options.out.empty()) {
    write_file(options.out, discrepancy::extended_model_text(model, result, seen, options.model, kVersion),
               options.force);
    json["extended_model"] = options.out;
  }
  if (!options.report.empty()) {
    progress("drawing");
    const auto page = discrepancy::study_page(result, seen, {options.map, options.model, options.vehicle, kVersion});
    if (!page) throw Failure(kUnavailable, page.error().message);
    write_file(options.report, *page, options.force);
  }
  if (options.json)
    print(json);
  else
    print_text(result, seen);
  return kOk;
}

}  // namespace

Verb study_verb(CLI::App& app) {
  auto options = std::make_shared<Options>();
  auto* command = app.add_subcommand("study", "What the simulation gets wrong, by name, with the gain");
  command->add_option("--map", options->map,
                      "OctoMap file or builtin:NAME; without one, no surface but the floor z = 0");
  command->add_option("--model", options->model, "model file or builtin:NAME")->capture_default_str();
  command->add_option("--vehicle", options->vehicle, "vehicle file or builtin:NAME")->required();
  command->add_option("--log", options->logs, "flight logs, one flight each")->required();
  command->add_option("--report", options->report, "HTML page to write");
  command->add_option("--out", options->out, "extended model file to write");
  command->add_option("--seed", options->seed, "of the null's sign draws")->capture_default_str();
  command->add_flag("--quick", options->quick, "without the smallest effects that could have been found");
  command->add_flag("--json", options->json, "one JSON object on stdout");
  command->add_flag("--force", options->force, "overwrite --report and --out");
  command->footer(
      "Example:\n  backwash study --map room.bt --model builtin:quad-5in --vehicle builtin:quad-5in --log flight*.csv "
      "--report study.html --out extended.toml");
  return {command, [options] { return run(*options); }};
}

}  // namespace backwash::services
