// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/learn/study_simulation.hpp"

#include <map>
#include <tuple>
#include <utility>

#include "core/sim/setpoint_flight.hpp"
#include "core/study/windows/observer.hpp"
#include "services/backwash/verb.hpp"
#include "services/parallel/parallel.hpp"

namespace backwash::services {
namespace {

constexpr std::size_t kReplicas = 4;

}  // namespace

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

}  // namespace backwash::services
