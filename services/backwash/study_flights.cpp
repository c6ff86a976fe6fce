// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/study_flights.hpp"

#include <algorithm>
#include <functional>
#include <numeric>

#include "core/log/dataflash.hpp"
#include "core/log/import_columns.hpp"
#include "core/log/median.hpp"
#include "core/log/raw_flight.hpp"
#include "core/log/same_flight.hpp"
#include "core/log/ulog.hpp"
#include "core/study/windows/same_gusts.hpp"
#include "core/types/formatted.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

/// Leaves out the later of two flights with the same gusts; whether there was one.
bool leave_out_twins(Flights& flights, const study::Observations& seen) {
  const auto order = flights.order();
  const auto same = study::same_gusts(seen);
  std::vector<std::size_t> twins;
  for (std::size_t f = 0; f < same.size(); ++f) {
    if (same[f] == f) continue;
    twins.push_back(order[f]);
    flights.twice.emplace_back(flights.paths[order[f]], flights.paths[order[same[f]]]);
  }
  std::ranges::sort(twins, std::greater());
  for (const std::size_t k : twins) {
    const auto at = static_cast<std::ptrdiff_t>(k);
    flights.paths.erase(flights.paths.begin() + at), flights.logs.erase(flights.logs.begin() + at);
    if (!flights.group.empty()) flights.group.erase(flights.group.begin() + at);
  }
  return !twins.empty();
}

/// A flight that is below the map's lowest voxel most of the time has its heights downwards, or another map.
void refuse_below(const Flights& flights, const map::OccupancyGrid& grid) {
  for (std::size_t k = 0; k < flights.logs.size(); ++k) {
    const auto& z = flights.logs[k].column("z_m");
    if (!z.empty() && log::median(z) < grid.origin().z())
      throw Failure(kBadData, flights.paths[k] + ":1: z_m is below the map in most rows (median " +
                                  formatted("%.2f", log::median(z)) + " m): heights are upwards, in the map's frame");
  }
}

study::Observations look_at(const Flights& flights, const Vehicle& vehicle, const Model& model,
                            const map::OccupancyGrid* grid) {
  const auto order = flights.order();
  study::Observer observer(vehicle, model, grid);
  for (const std::size_t k : order) observer.add(flights.logs[k]);
  auto seen = observer.finish();
  if (flights.group.empty()) return seen;
  std::vector<double> by_flight;
  by_flight.reserve(order.size());
  for (const std::size_t k : order) by_flight.push_back(flights.group[k]);
  seen.group(by_flight);
  return seen;
}

}  // namespace

bool is_autopilots_log(const std::string& path) {
  return path.ends_with(".ulg") || path.ends_with(".bin") || path.ends_with(".BIN");
}

log::FlightLog read_flight(const std::string& path) {
  if (log::is_raw_log(path)) return read_or_fail(log::flight_of_raw_log(read_or_fail(log::read_raw_log(path)), path));
  if (!is_autopilots_log(path)) return read_table(path, "t_s");
  return read_or_fail(path.ends_with(".ulg") ? log::read_ulog(path) : log::read_dataflash(path));
}

log::FlightLog read_studied(const std::string& path) {
  auto log = read_flight(path);
  for (const char* name : {"x_m", "y_m", "z_m"})
    if (!log.has(name))
      throw Failure(kBadData, path + ":1: no column '" + name + "'; a study needs positions x_m, y_m, z_m");
  for (const auto& name : log::silent_columns(log)) log.columns.erase(name);
  if (is_autopilots_log(path)) return log;
  if (const auto wrong = log::impossible(log); !wrong.empty()) throw Failure(kBadData, path + ":1: " + wrong.front());
  return log;
}

Flights read_flights(const std::vector<std::string>& paths, const std::string& group) {
  Flights flights;
  std::vector<log::FlightMark> marks;
  const auto read = [&](const std::string& path) {
    progress("reading " + path);
    auto log = read_studied(path);
    if (!group.empty() && (!log.has(group) || log.column(group).empty()))
      throw Failure(kBadData, path + ":1: no column '" + group + "' to group flights by; name one that it has");
    const log::FlightMark mark(log);
    const auto known = std::ranges::find_if(marks, [&](auto& m) { return m.shared(mark) >= log::kSameFlight; });
    if (known != marks.end()) {
      flights.twice.emplace_back(path, flights.paths[static_cast<std::size_t>(known - marks.begin())]);
      return;
    }
    marks.push_back(mark);
    if (!group.empty()) flights.group.push_back(log.column(group).front());
    flights.paths.push_back(path);
    flights.logs.push_back(std::move(log));
  };
  for (const auto& path : paths) read(path);
  return flights;
}

std::vector<std::size_t> Flights::order() const {
  std::vector<std::size_t> order(logs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (!group.empty())
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return group[a] < group[b]; });
  return order;
}

study::Observations observe(Flights& flights, const Vehicle& vehicle, const Model& model,
                            const map::OccupancyGrid* grid) {
  if (grid) refuse_below(flights, *grid);
  auto seen = look_at(flights, vehicle, model, grid);
  return leave_out_twins(flights, seen) ? look_at(flights, vehicle, model, grid) : seen;
}

}  // namespace backwash::services
