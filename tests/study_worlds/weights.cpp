// SPDX-License-Identifier: BSD-3-Clause
#include "tests/study_worlds/weights.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <tuple>

#include "tests/study_worlds/effects.hpp"
#include "tests/study_worlds/observe.hpp"
#include "tests/study_worlds/summary.hpp"

namespace study_worlds {
namespace {

double thrust_of(const Craft& c, double u) { return c.thr_mdl_fac * u * u + (1 - c.thr_mdl_fac) * u; }
double command_of(const Craft& c, double share) {
  const double f = c.thr_mdl_fac;
  return (std::sqrt((1 - f) * (1 - f) + 4 * f * share) - (1 - f)) / (2 * f);
}

/// Factors on each rotor's thrust: of a weight beside the middle the moments balance, so that rotors that face each
/// other share the whole alike (1–3, 2–4).
std::array<double, 4> factors(double mass, double lever, double angle, std::size_t rotor) {
  const double moment = 2 * lever * mass / (1 + mass);
  std::array<double, 4> all{};
  for (std::size_t k = 0; k < 4; ++k)
    all[(rotor + k) % 4] = (1 + mass) * (1 + moment * std::cos(angle - static_cast<double>(k) * M_PI / 2));
  return all;
}

void change_thrust(std::vector<Table>& flights, const Craft& craft, const std::array<double, 4>& factor) {
  for (auto& table : flights)
    for (std::size_t r = 0; r < 4; ++r)
      for (const char* kind : {"motor", "rpm"}) {
        const auto at = std::find(table.names.begin(), table.names.end(), kind + std::to_string(r + 1));
        const auto column = static_cast<std::size_t>(at - table.names.begin());
        for (auto& row : table.rows)
          row[column] = *kind == 'r' ? row[column] * std::sqrt(factor[r])
                                     : command_of(craft, thrust_of(craft, row[column]) * factor[r]);
      }
}

HiddenWorld drawn_world(const RotorTrial& trial, const Request& request, std::mt19937_64& rng) {
  const auto u = [&](double low, double high) { return std::uniform_real_distribution(low, high)(rng); };
  HiddenWorld world = draw_world(request);
  Craft& c = world.craft;
  if (trial.craft == "quad-7in") {
    c.mass = 1.9;
    c.max_thrust = 38;
    c.model = trial.craft;
  }
  if (trial.craft == "quad-5in") {
    c.mass = 0.9;
    c.max_thrust = 18;
    c.model = trial.craft;
  }
  if (trial.craft != "drawn") return world;
  c.mass *= u(0.6, 1.5);
  c.max_thrust = c.mass * 9.81 * u(1.9, 3.5);
  c.thr_mdl_fac = u(0.05, 0.8);
  return world;
}

}  // namespace

RotorOutcome score(const RotorTrial& trial, std::uint64_t seed, const std::filesystem::path& folder) {
  std::mt19937_64 rng(seed * 69621 + 11);
  const auto u = [&](double low, double high) { return std::uniform_real_distribution(low, high)(rng); };
  RotorOutcome out;
  out.trial = trial;
  out.seed = seed;
  const std::size_t rotor = rng() % 4;
  const std::uint64_t of_craft = trial.craft == "drawn" ? 2 : trial.craft == "quad-7in" ? 1 : 0;
  const Request request{3 * seed + of_craft, {}, 1, 12, ""};
  HiddenWorld world = drawn_world(trial, request, rng);
  if (trial.hidden == "weight") {
    out.size = u(0.06, 0.2);
    world.effects.size["payload"] = out.size;
  }
  auto flights = fly_all(world);
  if (trial.hidden == "weight")
    change_thrust(flights, world.craft, factors(out.size, u(0.8, 1.1), u(-0.2, 0.2), rotor));
  if (trial.hidden == "propeller") {
    std::array<double, 4> factor{1, 1, 1, 1};
    factor[rotor] += out.size = u(0.1, 0.4);
    change_thrust(flights, world.craft, factor);
  }
  backwash::study::StudyOptions options;
  if (trial.reference) options = with_reference(world, folder);
  options.minimum_detectable = options.dependence = false;
  const auto result = backwash::study::study(observe(world, flights, folder), options);
  const bool flew = result.verdict != backwash::study::StudyVerdict::insufficient;  // else a rotor is at its limit
  out.told = flew ? told(result) : "insufficient";
  const std::string truth = trial.hidden == "weight"      ? "payload"
                            : trial.hidden == "propeller" ? "propeller_damage"
                                                          : "";
  for (const auto& cause : result.causes) {
    const auto& name = cause.found.form->cause();
    const bool alone = cause.found.rivals.empty();
    bool holds = name == truth;
    for (const auto& r : cause.found.rivals) holds = holds || r.name == truth;
    out.in_set = out.in_set || holds;
    out.right_alone = out.right_alone || (alone && name == truth);
    const bool of_rotors = cause.found.form->integer_scale;
    out.wrong = out.wrong || (alone && of_rotors && name != truth);
  }
  return out;
}

nlohmann::json to_json(const RotorOutcome& o) {
  return {{"hidden", o.trial.hidden}, {"craft", o.trial.craft}, {"reference", o.trial.reference},
          {"seed", o.seed},           {"size", o.size},         {"wrong", o.wrong},
          {"in_set", o.in_set},       {"alone", o.right_alone}, {"told", o.told}};
}

std::string weights_table(const std::vector<RotorOutcome>& outcomes) {
  struct Row {
    Rate wrong, in_set, alone;
  };
  std::map<std::tuple<std::string, std::string, bool>, Row> rows;
  for (const auto& o : outcomes) {
    Row& row = rows[{o.trial.hidden, o.trial.craft, o.trial.reference}];
    row.wrong.count(o.wrong);
    row.in_set.count(o.in_set);
    row.alone.count(o.right_alone);
  }
  std::ostringstream text;
  text << "| hidden | craft | reference flights | wrong name, alone | truth in a set | right name alone |\n"
          "| --- | --- | --- | --- | --- | --- |\n";
  const auto rate = [](const Rate& r) { return std::to_string(r.hits) + "/" + std::to_string(r.n); };
  for (const auto& [key, row] : rows)
    text << "| " << std::get<0>(key) << " | " << std::get<1>(key) << " | " << (std::get<2>(key) ? "six" : "none")
         << " | " << rate(row.wrong) << " | " << rate(row.in_set) << " | " << rate(row.alone) << " |\n";
  return text.str();
}

}  // namespace study_worlds
