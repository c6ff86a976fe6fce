// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/learn/study_simulation.hpp"

#include <toml++/toml.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <tuple>
#include <utility>

#include "core/sim/setpoint_flight.hpp"
#include "core/study/windows/observer.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/verb.hpp"
#include "services/parallel/parallel.hpp"

namespace backwash::services {
namespace {

constexpr std::size_t kReplicas = 4;

/// Flights that were measured, in the order of their observations, and what they were flown with.
struct FlownAgain {
  struct Flight {
    const log::FlightLog& log;
    std::string path;
    const map::OccupancyGrid& grid;
  };
  std::vector<Flight> flights;
  const Vehicle& vehicle;
  const Model& model;
  std::uint64_t seed;
};

study::Told simulated(const FlownAgain& again, const std::vector<SimulationTerm>& terms,
                      const study::Observations& measured) {
  std::vector<sim::LoggedFlight> logged;
  for (const auto& flown : again.flights) {
    auto flight = sim::logged_flight(flown.log, again.vehicle, flown.path);
    if (!flight) throw Failure(kBadData, flight.error().message);
    logged.push_back(std::move(*flight));
  }
  std::vector<study::Observations> replicas(kReplicas);
  run_parallel(kReplicas, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      std::map<const map::OccupancyGrid*, std::pair<sim::ModelField, study::MapView>> rooms;
      const auto room_of = [&](const map::OccupancyGrid& grid) -> auto& {
        return rooms
            .try_emplace(&grid, std::piecewise_construct, std::forward_as_tuple(grid, again.model),
                         std::forward_as_tuple(&grid, again.model))
            .first->second;
      };
      study::Observer all(again.vehicle, room_of(again.flights.front().grid).second);
      for (std::size_t k = 0; k < logged.size(); ++k) {
        const std::uint64_t seed = again.seed + 10 * (r + kReplicas * k);
        const auto& flown = again.flights[k];
        auto& [field, surroundings] = room_of(flown.grid);
        const auto samples =
            sim::fly_setpoints(flown.grid, again.vehicle, logged[k], seed, {.terms = terms, .air = &field});
        study::Observer observer(again.vehicle, surroundings);
        observer.add(sim::to_log(samples, logged[k], flown.log));
        all.add(observer.take());
      }
      replicas[r] = all.finish();
    }
  });
  return study::told_of(measured, replicas);
}

}  // namespace

std::string residuals(const Simulated& by, const Flights& flights, const LookedWith& with,
                      const study::Observations& measured, const std::vector<SimulationTerm>& found,
                      report::PageData& data) {
  FlownAgain again{{}, with.vehicle, by.model, by.seed};
  for (const std::size_t k : flights.order())
    again.flights.push_back({flights.logs[k], flights.paths[k], *with.rooms[flights.rooms[k]].grid});
  auto terms = read_simulation(by.path);
  progress("simulating the flights without the causes");
  const auto before = simulated(again, terms, measured);
  terms.insert(terms.end(), found.begin(), found.end());
  progress("simulating the flights with the causes");
  return study::residual_section(measured, before, simulated(again, terms, measured), data);
}

std::vector<study::ExtensionTerm> read_terms(const std::string& path) {
  std::vector<study::ExtensionTerm> terms;
  if (path.starts_with("builtin:")) return terms;
  const auto file = toml::parse_file(path);  // load_model has accepted it
  const auto* list = file.at_path("extension.term").as_array();
  if (!list) return terms;
  for (const auto& entry : *list) {
    const auto* table = entry.as_table();
    if (!table) continue;
    study::ExtensionTerm term{(*table)["cause"].value_or(std::string()),
                              (*table)["form"].value_or(std::string()),
                              {(*table)["scale"].value_or(0.0)},
                              {}};
    if (const auto* offset = (*table)["offset_m"].as_array(); offset && offset->size() == 2)
      term.scale.offset_W = {(*offset)[0].value_or(0.0), (*offset)[1].value_or(0.0), 0};
    if (const auto* theta = (*table)["theta"].as_array())
      for (const auto& value : *theta) term.theta.push_back(value.value_or(0.0));
    term.gain = (*table)["held_out_nats"].value_or(0.0);
    term.flights = static_cast<std::size_t>(std::max<std::int64_t>(0, (*table)["flights"].value_or(std::int64_t{0})));
    for (const auto& [key, numbers] : {std::pair{"anchor", &term.scale.anchor}, {"beside", &term.beside}})
      if (const auto* list_of = (*table)[key].as_array())
        for (const auto& value : *list_of) numbers->push_back(value.value_or(0.0));
    terms.push_back(std::move(term));
  }
  return terms;
}

std::string earlier_terms(const std::string& path) {
  if (path.starts_with("builtin:")) return "";
  const auto file = toml::parse_file(path);  // load_model has accepted it
  const auto* list = file.at_path("extension.term").as_array();
  if (!list) return "";
  std::ostringstream text;
  text << toml::toml_formatter{toml::table{{"extension", toml::table{{"term", *list}}}}};
  return text.str();
}

}  // namespace backwash::services
