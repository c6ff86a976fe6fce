// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/study_design.hpp"

#include <algorithm>
#include <cstdio>

#include "core/plan/ends.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/verb.hpp"
#include "services/parallel/parallel.hpp"

namespace backwash::services {
namespace {

constexpr std::size_t kTold = 3;  // flights, in the text

double seconds(const study::NextFlight& flight) { return kControlPeriod * static_cast<double>(flight.commands.size()); }

}  // namespace

void add_design(Command& command, DesignOptions& options) {
  command.add_option("--design", options.points,
                     "points file of the flight that tells a set apart soonest, for backwashctl follow; needs --map "
                     "and --start");
  add_point(command, "--start", options.start, "where that flight begins, m");
  command.add_option("--flight-time", options.flight_time, "of that flight, s").capture_default_str().check(positive());
}

void check_design(const DesignOptions& options, const std::string& map, bool force) {
  if (options.points.empty()) return;
  if (map.empty() || !options.start)
    throw Failure(kUsage, "--design needs --map, to fly in, and --start, where the flight begins");
  check_output(options.points, force);
}

std::optional<study::Design> designed(const DesignOptions& options, const study::Observations& seen,
                                      const study::StudyResult& result, const Model& model, const Vehicle& vehicle,
                                      const map::OccupancyGrid* grid, bool force) {
  if (options.points.empty()) return std::nullopt;
  progress("the next flight");
  const auto world = plan::build_world(*grid, model, vehicle, reach::Method::tight, std::nullopt, run_parallel);
  if (const auto why = plan::why_blocked(*world, *options.start, 0))
    throw Failure(kUnavailable, "--start " + *why + ": begin where hovering is safe");
  auto design = study::design(seen, result, *world, model, *options.start, options.flight_time);
  if (const auto* chosen = design.chosen()) write_file(options.points, study::points_csv(chosen->points_W), force);
  return design;
}

Json to_json(const study::Design& design, const DesignOptions& options) {
  Json sets = Json::array(), flights = Json::array(), left_out = Json::array();
  for (const auto& set : design.sets) {
    Json pairs = Json::array();
    for (const auto& [i, j] : set.pairs) pairs.push_back({set.names[i], set.names[j]});
    sets.push_back({{"names", set.names}, {"probability", set.probability}, {"pairs", pairs}});
  }
  for (const auto& f : design.flights) {
    flights.push_back({{"name", f.name},
                       {"used_battery", f.used_battery},
                       {"start_voltage", f.voltage ? Json(*f.voltage) : Json()},
                       {"divergence_nats", f.divergence},
                       {"pairs_nats", f.of_pair},
                       {"flights", f.flights ? Json(*f.flights) : Json()},
                       {"separated", f.separated},
                       {"rows", f.points_W.size()},
                       {"time_s", seconds(f)}});
  }
  for (const auto& [name, why] : design.left_out) left_out.push_back({{"name", name}, {"why", why}});
  return {{"message", design.message},
          {"points", design.chosen() ? Json(options.points) : Json()},
          {"sets", sets},
          {"flights", flights},
          {"left_out", left_out}};
}

void print_text(const study::Design& design, const DesignOptions& options) {
  std::printf("next flight: %s\n", design.message.c_str());
  for (const auto& set : design.sets) {
    std::printf("  of the set");
    for (std::size_t i = 0; i < set.names.size(); ++i)
      std::printf("%s %s (%.2f)", i ? "," : "", set.names[i].c_str(), set.probability[i]);
    std::printf("\n");
  }
  for (std::size_t k = 0; k < std::min(kTold, design.flights.size()); ++k) {
    const auto& f = design.flights[k];
    std::printf("  %s%s: %.3g nats a flight expected, ", f.name.c_str(), f.used_battery ? ", used battery" : "",
                f.divergence);
    if (f.flights)
      std::printf("%d flight%s of %.0f s\n", *f.flights, f.flights > 1 ? "s" : "", seconds(f));
    else
      std::printf("does not separate (P = %.2f)\n", f.separated);
  }
  if (const auto* best = design.chosen()) {
    if (best->voltage) std::printf("  begin with the battery at about %.1f V\n", *best->voltage);
    std::printf("  %s: %zu rows, for backwashctl follow\n", options.points.c_str(), best->points_W.size());
  }
  if (!design.flights.empty() || !design.left_out.empty())
    std::printf("  %zu ways fit in the map, %zu do not\n", design.flights.size(), design.left_out.size());
  for (const auto& [name, why] : design.left_out) std::printf("  does not fit: %s (%s)\n", name.c_str(), why.c_str());
}

}  // namespace backwash::services
