// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/learn/study_design.hpp"

#include <algorithm>
#include <cstdio>
#include <span>

#include "core/config/route_file.hpp"
#include "core/plan/search/ends.hpp"
#include "core/report/page/page.hpp"
#include "core/types/formatted.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

constexpr std::size_t kFlightsTold = 3;  // flights, in the text

double seconds(const study::NextFlight& flight) { return kControlPeriod * static_cast<double>(flight.commands.size()); }

std::string name_of(const study::NextFlight& flight) {
  return flight.name + (flight.used_battery ? ", used battery" : "");
}

std::string set_of(const study::DesignedSet& set) {
  std::string text;
  for (std::size_t i = 0; i < set.names.size(); ++i)
    text += formatted("%s%s (%.2f)", i ? ", " : "", set.names[i].c_str(), set.probability[i]);
  return text;
}

/// What so many of a flight tell.
std::string outcome_of(const study::NextFlight& f) {
  const auto nats = formatted("%.3g nats a flight expected, ", f.divergence);
  if (!f.flights) return nats + formatted("does not separate (P = %.2f)", f.separated);
  return nats + formatted("%d flight%s of %.0f s", *f.flights, f.flights > 1 ? "s" : "", seconds(f));
}

std::span<const study::NextFlight> told_flights(const study::Design& design) {
  return std::span(design.flights).first(std::min(kFlightsTold, design.flights.size()));
}

}  // namespace

void add_design(Command& command, DesignOptions& options) {
  command.add_option("--design", options.points,
                     "points file of the flight that tells a set apart soonest, for backwashctl follow; needs --map "
                     "and --start");
  add_point(command, "--start", options.start, "where that flight begins, m");
  command.add_option("--flight-time", options.flight_time, "of that flight, s").capture_default_str().check(positive());
}

void check_design(const DesignOptions& options, bool mapless, bool force) {
  if (options.points.empty()) {
    if (options.start) throw Failure(kUsage, "--start is where the flight of --design begins; give that too");
    return;
  }
  if (mapless || !options.start)
    throw Failure(kUsage, "--design needs --map, to fly in, the first, and --start, where the flight begins");
  check_output(options.points, force);
}

std::optional<study::Design> designed(const DesignOptions& options, const study::Observations& seen,
                                      const study::StudyResult& result, const Model& model, const Vehicle& vehicle,
                                      const map::OccupancyGrid* grid, bool force) {
  if (options.points.empty()) return std::nullopt;
  progress("the next flight");
  const auto world = plan::build_world(*grid, model, vehicle, reach::Method::tight, std::nullopt, run_shown);
  if (const auto why = plan::why_no_rest(*world, *options.start, 0))
    throw Failure(kUnavailable, "--start " + *why + ": begin where hovering is safe");
  auto design = study::design(seen, result, *world, model, *options.start, options.flight_time);
  const auto refusal = [](const std::string& path) {
    const auto route = config::read_route(path);
    return route ? "" : route.error().message;
  };
  if (const auto* chosen = design.chosen())
    write_file(options.points, study::points_csv(chosen->points), force, refusal);
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
                       {"rows", f.points.size()},
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
  for (const auto& set : design.sets) std::printf("  of the set %s\n", set_of(set).c_str());
  for (const auto& f : told_flights(design)) std::printf("  %s: %s\n", name_of(f).c_str(), outcome_of(f).c_str());
  if (const auto* best = design.chosen()) {
    if (best->voltage) std::printf("  begin with the battery at about %.1f V\n", *best->voltage);
    std::printf("  %s: %zu rows, for backwashctl follow\n", options.points.c_str(), best->points.size());
  }
  if (!design.flights.empty() || !design.left_out.empty())
    std::printf("  %zu ways fit in the map, %zu do not\n", design.flights.size(), design.left_out.size());
  for (const auto& [name, why] : design.left_out) std::printf("  does not fit: %s (%s)\n", name.c_str(), why.c_str());
}

std::string html(const study::Design& design, const DesignOptions& options) {
  using report::row;
  std::string rows;
  for (const auto& set : design.sets) rows += row("To tell apart, with their probabilities", set_of(set));
  for (const auto& f : told_flights(design)) rows += row(name_of(f), outcome_of(f));
  if (const auto* best = design.chosen()) {
    if (best->voltage) rows += row("Begin with the battery at about", formatted("%.1f V", *best->voltage));
    rows += row("To fly it", "backwashctl follow " + options.points);
  }
  for (const auto& [name, why] : design.left_out) rows += row("Does not fit in the map: " + name, why);
  return report::section("The next flight", report::escaped(design.message), report::table(rows));
}

}  // namespace backwash::services
