// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/learn/study_simulation.hpp"

#include "core/sim/setpoint_flight.hpp"
#include "core/study/windows/observer.hpp"
#include "services/backwash/verb.hpp"
#include "services/parallel/parallel.hpp"

namespace backwash::services {
namespace {

constexpr std::size_t kReplicas = 4;

}  // namespace

study::Told simulated(const FlownAgain& flights, const std::vector<SimulationTerm>& terms,
                      const study::Observations& measured) {
  std::vector<sim::LoggedFlight> logged;
  for (std::size_t k = 0; k < flights.logs.size(); ++k) {
    auto flight = sim::logged_flight(*flights.logs[k], flights.vehicle, flights.paths[k]);
    if (!flight) throw Failure(kBadData, flight.error().message);
    logged.push_back(std::move(*flight));
  }
  std::vector<study::Observations> replicas(kReplicas);
  run_parallel(kReplicas, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      sim::ModelField field(flights.grid, flights.model);
      study::Observer observer(flights.vehicle, flights.model, &flights.grid);
      for (std::size_t k = 0; k < logged.size(); ++k) {
        const std::uint64_t seed = flights.seed + 10 * (r + kReplicas * k);
        const auto samples =
            sim::fly_setpoints(flights.grid, flights.vehicle, logged[k], seed, {.terms = terms, .air = &field});
        observer.add(sim::to_log(samples, logged[k], *flights.logs[k]));
      }
      replicas[r] = observer.finish();
    }
  });
  return study::told_of(measured, replicas);
}

}  // namespace backwash::services
