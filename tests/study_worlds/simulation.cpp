// SPDX-License-Identifier: BSD-3-Clause
#include "tests/study_worlds/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/sim/setpoint_flight.hpp"
#include "core/study/findings/extend.hpp"
#include "core/study/findings/residuals.hpp"
#include "core/study/windows/observer.hpp"
#include "tests/study_worlds/observe.hpp"
#include "tests/support/terms_of.hpp"

namespace study_worlds {

namespace study = backwash::study;
namespace sim = backwash::sim;

namespace {

constexpr double kAsTruth = 1.1;  // error over the truth's own that counts as reached

study::StudyOptions quick(const HiddenWorld& world, const std::filesystem::path& folder) {
  auto options = with_reference(world, folder);
  options.minimum_detectable = options.dependence = false;
  return options;
}

backwash::log::FlightLog log_of(const Table& table) {
  backwash::log::FlightLog log;
  for (std::size_t c = 0; c < table.names.size(); ++c) {
    auto& column = table.names[c] == "t_s" ? log.t_s : log.columns[table.names[c]];
    for (const auto& row : table.rows) column.push_back(row[c]);
  }
  return log;
}

/// What is simulated is observed with the map, vehicle and model that the study was given.
struct Given {
  backwash::Vehicle vehicle;
  backwash::Model model;
  backwash::map::OccupancyGrid grid;
  sim::ModelField field;
  study::MapView surroundings;
  Given(const HiddenWorld& world, const std::filesystem::path& folder)
      : vehicle(backwash::config::load_vehicle((folder / "vehicle.toml").string()).value()),
        model(model_of(world, vehicle)),
        grid(backwash::map::load_map((folder / "map.bt").string()).value()),
        field(grid, model),
        surroundings(&grid, model) {}
  Given(const Given&) = delete;

 private:
  static backwash::Model model_of(const HiddenWorld& world, const backwash::Vehicle& vehicle) {
    auto model = backwash::config::load_model("builtin:" + world.craft.model).value();
    model.ground.r0 = vehicle.body.diagonal_radius;
    return model;
  }
};

/// The flights' set-points through core/sim in the model's air.
std::vector<study::Observations> simulated(Given& given, const std::vector<Table>& flights,
                                           const std::vector<backwash::SimulationTerm>& terms, int replicas) {
  std::vector<study::Observations> all;
  for (int r = 0; r < replicas; ++r) {
    study::Observer observer(given.vehicle, given.surroundings);
    for (std::size_t k = 0; k < flights.size(); ++k) {
      const auto from = log_of(flights[k]);
      const auto flight = sim::logged_flight(from, given.vehicle, "flight").value();
      const auto seed = 7919 + 100 * k + static_cast<std::size_t>(10 * r);
      const auto samples =
          sim::fly_setpoints(given.grid, given.vehicle, flight, seed, {.terms = terms, .air = &given.field});
      observer.add(sim::to_log(samples, flight, from));
    }
    all.push_back(observer.finish());
  }
  return all;
}

/// The same flights by the generator itself, with other gusts and other scatter between flights.
std::vector<study::Observations> truth_again(Given& given, const HiddenWorld& world, int first, int count,
                                             int replicas) {
  std::vector<study::Observations> all;
  for (int r = 0; r < replicas; ++r) {
    study::Observer observer(given.vehicle, given.surroundings);
    for (int k = first; k < first + count; ++k) observer.add(log_of(fly_again(world, k, static_cast<unsigned>(r + 1))));
    all.push_back(observer.finish());
  }
  return all;
}

std::vector<study::Channel> channels_of(const study::Accepted& found) {
  std::set<study::Channel> channels;
  for (const auto& column : found.columns)
    for (const auto& part : column.parts)
      if (!part.aside) channels.insert(part.channel);  // what it moves itself
  return {channels.begin(), channels.end()};
}

/// Errors before, after and of the truth's own simulation, over the cause's channels.
void compare(Proof& proof, const study::Accepted& found, const study::Observations& measured, const study::Told& before,
             const study::Told& after, const study::Told& truth) {
  double b = 0, a = 0, n = 0;
  const bool about_mean = !found.form->constant;
  for (const auto c : channels_of(found)) {
    const auto of_before = channel_error(measured, before, c, about_mean),
               of_after = channel_error(measured, after, c, about_mean),
               of_truth = channel_error(measured, truth, c, about_mean);
    if (!of_before || !of_after || !of_truth) continue;
    // The generator knows how this craft's rotors were built, which no simulation does and no cause is.
    const double eb = of_before->value, ea = of_after->value, eo = std::hypot(of_truth->value, study::built_scatter(c));
    if (!(eo > 0) || !(eb > 0)) continue;
    if (n == 0) {
      proof.channel = study::channel_name(c);
      proof.unit_before = eb;
      proof.unit_after = ea;
      proof.unit_oracle = eo;
    }
    b += std::pow(eb / eo, 2);
    a += std::pow(ea / eo, 2);
    n += 1;
  }
  if (n == 0) return;
  proof.simulated = true;
  proof.before = std::sqrt(b / n);
  proof.after = std::sqrt(a / n);
  proof.share = b > n ? (b - a) / (b - n) : 0;
}

double median(std::vector<double> x) {
  if (x.empty()) return 0;
  std::sort(x.begin(), x.end());
  return x[x.size() / 2];
}

std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", x);
  return text;
}

}  // namespace

Proof prove(const ProofRequest& request, const std::filesystem::path& folder) {
  Proof proof;
  proof.cause = request.cause;
  proof.seed = request.seed;
  HiddenWorld world = draw_world({request.seed, {request.cause}, 1, 2 * request.flights, ""});
  world.craft.rotor_spread = 0.01;  // how a craft is built is no term of a simulation
  const auto all = fly_all(world);
  const std::vector<Table> fitted(all.begin(), all.begin() + request.flights),
      fresh(all.begin() + request.flights, all.end());
  const auto seen = observe(world, fitted, folder);
  const auto result = study::study(seen, quick(world, folder));
  proof.told = told(result);
  auto further = observe(world, fresh, folder);
  auto extended = further;
  auto after = with_reference(world, folder);  // with what remains, as `backwash study` asks it
  after.minimum_detectable = false;
  after.search.known = study::apply(study::terms_of(result), extended).known;
  proof.told_after = told(study::study(extended, after));
  const auto named = std::find_if(result.causes.begin(), result.causes.end(),
                                  [&](auto& c) { return c.found.form->cause() == request.cause; });
  if (named == result.causes.end()) return proof;
  proof.refused = named->applied.refused;
  if (!proof.refused.empty()) return proof;
  Given given(world, folder);
  const std::vector<Table> held_out(fresh.begin(), fresh.begin() + request.held_out);
  const auto measured = observe(world, held_out, folder);
  const auto told_by = [&](const std::vector<study::Observations>& by) { return study::told_of(measured, by); };
  compare(proof, named->found, measured, told_by(simulated(given, held_out, {}, request.replicas)),
          told_by(simulated(given, held_out, study::simulation_of(result, seen), request.replicas)),
          told_by(truth_again(given, world, request.flights, request.held_out, request.replicas)));
  return proof;
}

nlohmann::json to_json(const Proof& p) {
  return {{"cause", p.cause},
          {"seed", p.seed},
          {"told", p.told},
          {"refused", p.refused},
          {"simulated", p.simulated},
          {"before", p.before},
          {"after", p.after},
          {"share", p.share},
          {"channel", p.channel},
          {"unit", {p.unit_before, p.unit_after, p.unit_oracle}},
          {"told_after", p.told_after}};
}

Proof proof_from_json(const nlohmann::json& json) {
  Proof p;
  p.cause = json.at("cause");
  p.seed = json.at("seed");
  p.told = json.at("told");
  p.refused = json.at("refused");
  p.simulated = json.at("simulated");
  p.before = json.at("before");
  p.after = json.at("after");
  p.share = json.at("share");
  p.channel = json.at("channel");
  p.told_after = json.at("told_after");
  p.unit_before = json.at("unit").at(0);
  p.unit_after = json.at("unit").at(1);
  p.unit_oracle = json.at("unit").at(2);
  return p;
}

std::string proof_table(const std::vector<Proof>& proofs) {
  std::string page =
      "| hidden | named | refused | before / truth | after / truth | worst | within 1.1 | share | first channel: "
      "before, "
      "after, truth | further flights: nothing found |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- "
      "|\n";
  for (const auto& cause : cause_names()) {
    std::vector<double> before, after, share, ub, ua, uo;
    int worlds = 0, named = 0, refused = 0, within = 0, nothing = 0;
    std::string channel;
    for (const auto& p : proofs) {
      if (p.cause != cause) continue;
      ++worlds;
      nothing += p.told_after == "nothing" ? 1 : 0;
      named += p.simulated || !p.refused.empty() ? 1 : 0;
      refused += p.refused.empty() ? 0 : 1;
      if (!p.simulated) continue;
      before.push_back(p.before);
      after.push_back(p.after);
      share.push_back(p.share);
      channel = p.channel;
      ub.push_back(p.unit_before);
      ua.push_back(p.unit_after);
      uo.push_back(p.unit_oracle);
      within += p.after <= kAsTruth ? 1 : 0;
    }
    if (worlds == 0) continue;
    const std::string of = "/" + std::to_string(worlds);
    page += "| " + cause + " | " + std::to_string(named) + of + " | " + std::to_string(refused) + " | ";
    page += after.empty() ? "– | – | – | – | – | –"
                          : number(median(before)) + " | " + number(median(after)) + " | " +
                                number(*std::max_element(after.begin(), after.end())) + " | " + std::to_string(within) +
                                "/" + std::to_string(after.size()) + " | " + number(median(share)) + " | " + channel +
                                ": " + number(median(ub)) + ", " + number(median(ua)) + ", " + number(median(uo));
    page += " | " + std::to_string(nothing) + of + " |\n";
  }
  return page;
}

}  // namespace study_worlds
