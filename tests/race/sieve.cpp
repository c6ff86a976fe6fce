// SPDX-License-Identifier: BSD-3-Clause
// Trajectories that others planned, verified by each way of keeping clear and flown in the true air.
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>

#include "core/plan/rest.hpp"
#include "services/parallel/parallel.hpp"
#include "tests/race/flown.hpp"
#include "tests/race/race.hpp"
#include "tests/race/trajectories.hpp"

namespace backwash::race {
namespace {

constexpr int kFlights = 8;

/// By how much the tube may grow and stay clear, up to 8.
double clear_scale(const plan::World& world, const reach::ReachTube& tube) {
  const auto clear = [&](double scale) {
    reach::ReachTube scaled = tube;
    for (auto& step : scaled)
      for (double& h : step.half_widths_interval) h *= scale;
    return plan::tube_clearance(world, scaled) > 0;
  };
  if (!clear(0)) return 0;
  double low = -8, high = 3;  // of the logarithm to base 2
  for (int i = 0; i < 12; ++i) {
    const double middle = (low + high) / 2;
    (clear(std::exp2(middle)) ? low : high) = middle;
  }
  return std::exp2(low);
}

/// Worlds in which a trajectory is looked at.
struct Judges {
  plan::World tight, risk, bare;
};

std::string judged(const Judges& worlds, const Place& place, const Vehicle& vehicle, double air, Trajectory flight,
                   std::size_t n) {
  const State start{flight.commands.front().p_W, Vec3::Zero()};
  Setpoint hover;
  hover.p_W = start.p_W;
  plan::hold_until_settled(worlds.tight.reach, flight.commands);
  const auto tight = plan::tube_to_rest(worlds.tight, start, hover, flight.commands),
             risky = plan::tube_to_rest(worlds.risk, start, hover, flight.commands);
  const double risk =
      reach::risk_of_touching(worlds.risk.reach, place.grid, place.distance, worlds.risk.bounds.model(), risky).total;
  double width = 0;
  for (const auto& step : tight) width += step.half_widths[kX] / static_cast<double>(tight.size());
  int touched = 0;
  for (int k = 0; k < kFlights; ++k)
    touched += touches(place.grid, place.distance, vehicle, flight.commands, start.p_W,
                       7919 * n + 1000003ull * static_cast<unsigned>(k) + std::hash<std::string>{}(vehicle.name), air);
  char row[256];
  std::snprintf(row, sizeof row, "%s,%s,%g,%zu,%s,%g,%.4f,%.5f,%.4g,%.4f,%d,%d\n", flight.map.c_str(),
                flight.by.c_str(), flight.v_max, n, vehicle.name.c_str(), air, plan::tube_clearance(worlds.bare, tight),
                clear_scale(worlds.tight, tight), risk, width, kFlights, touched);
  return row;
}

void judge_all(std::ofstream& out, const Place& place, const Vehicle& vehicle, const std::vector<Trajectory>& all) {
  const Worlds worlds(place, vehicle, run_parallel);
  for (const double air : kAirs) {
    const Calibrated c = calibrated(vehicle, air);
    const Judges judges{worlds.make(c, {"", {}, {}}, run_parallel), worlds.make(c, {"", 1e-3, {}}, run_parallel),
                        worlds.make(c, {"", {}, 0.0}, run_parallel)};
    std::vector<std::string> rows(all.size());
    run_parallel(all.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n)
        if (all[n].map == place.name) rows[n] = judged(judges, place, vehicle, air, all[n], n);
    });
    for (const auto& row : rows) out << row;
    out.flush();
  }
}

}  // namespace

int sieve(const std::string& file, const std::string& folder) {
  std::ofstream out(file);
  out << "map,by,v_max,trajectory,vehicle,air,clearance,scale,risk,width,flights,touched\n";
  if (folder == "places") {
    const Place place = places();
    for (const auto& vehicle : population()) judge_all(out, place, vehicle, through_places(vehicle.body.radius, 40));
    return 0;
  }
  const auto all = rivals(folder);
  for (const char* const map : {"forest-1", "corridors"}) {
    const Place place = place_named(map);
    for (const char* const name : {"5in-shipped", "5in-px4", "5in-ardupilot", "5in-stiff", "5in-soft"})  // planned for
      judge_all(out, place, vehicle_named(name), all);
  }
  return 0;
}

}  // namespace backwash::race
