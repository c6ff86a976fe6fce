// SPDX-License-Identifier: BSD-3-Clause
#include "tests/race/race.hpp"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <set>

#include "services/parallel/parallel.hpp"
#include "tests/race/course.hpp"
#include "tests/race/flown.hpp"

namespace backwash::race {
namespace {

constexpr double kSpeeds[] = {1.5, 3};  // m/s
constexpr int kFlights = 4, kFlightsOfRisk = 8;
constexpr double kDrawn = 400;  ///< flights of a plan that uses up all of its risk, where risks are drawn

/// A pair at a speed.
struct Task {
  std::size_t pair;
  double v_max;
  sim::RoutePair route;
};

/// What is raced at once: one map, one vehicle, some pairs.
class Heat {
 public:
  Heat(const Place& place, const Vehicle& vehicle, std::size_t first, std::size_t count, Flights flights)
      : place_(place), vehicle_(vehicle), flights_(flights), worlds_(place, vehicle, run_parallel) {
    const auto pairs = pairs_of(place, vehicle, first + count);
    for (std::size_t n = first; n < pairs.size(); ++n)
      for (const double v_max : kSpeeds) tasks_.push_back({n, v_max, pairs[n]});
    hopeless_.resize(tasks_.size());
  }

  /// Rows of all ways and airs, each with `head` before it.
  std::string rows(const std::string& head, const std::map<double, Calibrated>& airs) {
    rows_.assign(tasks_.size(), "");
    for (const auto& [air, calibrated] : airs) {
      for (const Way& way : ways())
        if (!way.margin && raced(way)) race(head, way, calibrated, {air});
    }
    for (const Way& way : ways())  // a constant margin knows no air: one plan for all
      if (way.margin && raced(way)) race(head, way, airs.begin()->second, {std::begin(kAirs), std::end(kAirs)});
    std::string all;
    for (const auto& rows : rows_) all += rows;
    return all;
  }

 private:
  bool raced(const Way& way) const {
    return flights_ == Flights::all || way.name == "risk 1e-3" ||
           (flights_ == Flights::drawn && way.name == "risk 1e-2");
  }
  int flights_of(const Way& way, double stated) const {
    if (flights_ == Flights::all) return way.risk ? kFlightsOfRisk : kFlights;
    return 1 + (flights_ == Flights::drawn ? static_cast<int>(kDrawn * stated / *way.risk) : 0);
  }
  void race(const std::string& head, const Way& way, const Calibrated& calibrated, const std::vector<double>& airs) {
    const plan::World world = worlds_.make(calibrated, way, run_parallel);
    run_parallel(tasks_.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) rows_[n] += fly(world, head, way, n, airs);
    });
  }

  std::string fly(const plan::World& world, const std::string& head, const Way& way, std::size_t n,
                  const std::vector<double>& airs) {
    const Task& task = tasks_[n];
    // What one margin refuses a larger one refuses: its ways are among those of the smaller.
    const bool hopeless = way.margin && hopeless_[n];
    const auto plan = hopeless ? plan::Plan{} : planned(world, task.route, task.v_max);
    const bool ok = !hopeless && plan.status == plan::PlanStatus::ok;
    if (way.margin && !ok) hopeless_[n] = true;
    std::string rows;
    for (const double air : airs) {
      const int flights = ok ? flights_of(way, plan.metrics.risk.total) : 0;
      int touched = 0;
      for (int k = 0; k < flights; ++k)
        touched += touches(place_.grid, place_.distance, vehicle_, plan.commands, task.route.start_W,
                           task.route.seed + 1000003ull * static_cast<unsigned>(k), air);
      char row[256];
      std::snprintf(row, sizeof row, "%s,%g,%zu,%g,%s,%d,%.4g,%.2f,%d,%d\n", head.c_str(), task.v_max, task.pair, air,
                    way.name.c_str(), ok, ok ? plan.metrics.risk.total : 0, ok ? plan.metrics.time_s : 0, flights,
                    touched);
      rows += row;
    }
    return rows;
  }

  const Place& place_;
  const Vehicle& vehicle_;
  Flights flights_;
  Worlds worlds_;
  std::vector<Task> tasks_;
  std::vector<std::uint8_t> hopeless_;
  std::vector<std::string> rows_;
};

/// Heats whose last row is in the file.
std::set<std::string> done_in(const std::string& file) {
  std::set<std::string> done;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);)
    if (line.ends_with(",end")) done.insert(line.substr(0, line.size() - 4));
  return done;
}

}  // namespace

int fly_all(const std::string& file, std::size_t rounds, std::size_t pairs, const Chosen& only, Flights flights) {
  const auto done = done_in(file);
  std::ofstream out(file, std::ios::app);
  if (done.empty()) out << "round,map,vehicle,v_max,pair,air,way,planned,stated,time_s,flights,touched\n";
  std::map<std::string, std::map<double, Calibrated>> calibrations;
  for (const auto& vehicle : population())
    for (const double air : kAirs)
      if (only.vehicle.empty() || only.vehicle == vehicle.name)
        calibrations[vehicle.name][air] = calibrated(vehicle, air);
  for (std::size_t round = 0; round < rounds; ++round)
    for (const auto& map : maps()) {
      if (!only.map.empty() && only.map != map) continue;
      const Place place = place_named(map);
      for (const auto& vehicle : population()) {
        const std::string head = std::to_string(round) + "," + map + "," + vehicle.name;
        if (done.contains(head) || (!only.vehicle.empty() && only.vehicle != vehicle.name)) continue;
        Heat heat(place, vehicle, round * pairs, pairs, flights);
        out << heat.rows(head, calibrations.at(vehicle.name)) << head << ",end" << std::endl;
      }
    }
  return 0;
}

}  // namespace backwash::race
