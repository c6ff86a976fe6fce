// SPDX-License-Identifier: BSD-3-Clause
#include "tests/study_worlds/score.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <nlohmann/json.hpp>

#include "core/study/findings/when_it_acts.hpp"
#include "tests/study_worlds/observe.hpp"
#include "tests/study_worlds/oracle.hpp"

namespace study_worlds {
namespace {

bool holds(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

double cpu() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Two different causes, drawn from the seed.
std::vector<std::string> two_causes(std::uint64_t seed) {
  std::mt19937_64 rng(seed * 2654435761u + 11);
  auto names = cause_names();
  std::shuffle(names.begin(), names.end(), rng);
  return {names[0], names[1]};
}

}  // namespace

const std::vector<MatrixCell>& cells() {
  static const std::vector<MatrixCell> all = [] {
    std::vector<MatrixCell> list;
    for (const auto& name : cause_names()) list.push_back({name, {name}});
    list.insert(list.end(), {{"unknown", {"unknown"}},
                             {"none", {}},
                             {"none, no reference flights", {}, "", false, false},
                             {"two causes", {}, "", true},
                             {"thrust_slope, up and down", {"thrust_slope"}, "bob"},
                             {"ground_thrust, up and down", {"ground_thrust"}, "bob"},
                             {"actuator_lag, of the attitude", {"actuator_lag"}, "attitude"},
                             {"none, up and down", {}, "bob"},
                             {"rotor_drag, above 2 m/s", {"rotor_drag"}, "fast"},
                             {"none, above 2 m/s", {}, "fast"},
                             {"vibration, folded below 6 Hz", {"vibration"}, "fold"},
                             {"trim, no yaw turn", {"trim"}, "yaw"},
                             {"draft, no yaw turn", {"draft"}, "yaw"},
                             {"battery_sag, equal batteries", {"battery_sag"}, "battery"},
                             {"payload, equal batteries", {"payload"}, "battery"},
                             {"ceiling, two heights", {"ceiling"}, "height"},
                             {"ground_thrust, two heights", {"ground_thrust"}, "height"}});
    return list;
  }();
  return all;
}

bool WorldOutcome::in_sets() const {
  return std::all_of(truth.begin(), truth.end(), [&](const auto& name) {
    if (name == "unknown") return !unknown.empty();
    return std::any_of(sets.begin(), sets.end(), [&](const auto& set) { return holds(set, name); });
  });
}

bool WorldOutcome::wrong_name() const {
  return std::any_of(sets.begin(), sets.end(), [&](const auto& set) {
    return std::none_of(set.begin(), set.end(), [&](const auto& name) { return holds(truth, name); });
  });
}

bool WorldOutcome::right() const {
  const bool hidden_unknown = holds(truth, "unknown");
  const bool alone = std::all_of(sets.begin(), sets.end(), [](const auto& set) { return set.size() == 1; });
  return in_sets() && !wrong_name() && alone && (hidden_unknown || unknown.empty());
}

WorldOutcome score(const MatrixCell& cell, std::uint64_t seed, double size, int flights,
                   const std::filesystem::path& folder) {
  WorldOutcome out;
  out.cell = cell.name;
  out.seed = seed;
  out.size = size;
  out.truth = cell.two_drawn ? two_causes(seed) : cell.causes;
  const HiddenWorld world = draw_world({seed, out.truth, size, flights, cell.confound});
  auto options = cell.reference ? with_reference(world, folder) : backwash::study::StudyOptions();
  const double start = cpu();
  const auto tables = fly_all(world);
  const auto seen = observe(world, tables, folder);
  const double observed = cpu();
  options.minimum_detectable = false;
  const auto result = backwash::study::study(seen, options);
  out.world_s = observed - start;
  out.study_s = cpu() - observed;
  out.sets = sets_of(result);
  for (const auto& cause : result.causes) out.where.push_back(backwash::study::where(cause));
  for (const auto& u : result.unknown) out.unknown.push_back(u.along);
  if (holds(out.truth, "unknown")) {
    out.structure = text_of(world.effects.structure);
    out.explained = explained(seen, tables);
  }
  if (out.truth.size() != 1) return out;
  for (const auto& cause : result.causes) {
    if (cause.found.form->cause() != out.truth.front()) continue;
    out.compared = compare(world, tables, cause.found);
    out.error = parameter_error(out.compared);
    compare_with_oracle(out, cause.found, seen, tables);
  }
  return out;
}

nlohmann::json to_json(const WorldOutcome& o) {
  nlohmann::json json = {{"cell", o.cell},       {"seed", o.seed},         {"size", o.size},
                         {"truth", o.truth},     {"sets", o.sets},         {"unknown", o.unknown},
                         {"study_s", o.study_s}, {"world_s", o.world_s},   {"told", told(o.sets, o.unknown)},
                         {"right", o.right()},   {"in_sets", o.in_sets()}, {"wrong_name", o.wrong_name()}};
  for (const auto& c : o.compared) {
    nlohmann::json one = {{"name", c.name}, {"value", c.value}, {"ci95", {c.low, c.high}}, {"truth", c.truth}};
    if (c.best) one["best_of_form"] = *c.best;
    json["compared"].push_back(one);
  }
  if (std::ranges::any_of(o.where, [](auto& w) { return !w.empty(); })) json["where"] = o.where;
  if (!o.structure.empty()) {
    json["structure"] = o.structure;
    json["explained"] = o.explained;
  }
  if (o.error) json["parameter_error"] = *o.error;
  if (o.gain_share) json["gain_share"] = *o.gain_share;
  return json;
}

WorldOutcome from_json(const nlohmann::json& json) {
  WorldOutcome o;
  o.cell = json.at("cell");
  o.seed = json.at("seed");
  o.size = json.at("size");
  o.truth = json.at("truth").get<std::vector<std::string>>();
  o.sets = json.at("sets").get<std::vector<std::vector<std::string>>>();
  o.unknown = json.at("unknown").get<std::vector<std::string>>();
  o.study_s = json.at("study_s");
  o.world_s = json.at("world_s");
  for (const auto& c : json.value("compared", nlohmann::json::array())) {
    o.compared.push_back({c.at("name"), c.at("value"), c.at("ci95").at(0), c.at("ci95").at(1), c.at("truth"), {}});
    if (c.contains("best_of_form")) o.compared.back().best = c.at("best_of_form").get<double>();
  }
  o.where = json.value("where", std::vector<std::string>());
  o.structure = json.value("structure", "");
  o.explained = json.value("explained", 1.0);
  if (json.contains("parameter_error")) o.error = json.at("parameter_error").get<double>();
  if (json.contains("gain_share")) o.gain_share = json.at("gain_share").get<double>();
  return o;
}

}  // namespace study_worlds
