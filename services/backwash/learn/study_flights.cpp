// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/learn/study_flights.hpp"

#include <malloc.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/log/columns/import_columns.hpp"
#include "core/log/kinds/recording.hpp"
#include "core/log/raw/raw_flight.hpp"
#include "core/study/windows/observer.hpp"
#include "core/study/windows/signals/same_gusts.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

/// Leaves out each flight that is another one again, both by their numbers.
void leave_out(Flights& flights, const std::vector<std::pair<std::size_t, std::size_t>>& twins) {
  std::vector<char> left(flights.paths.size(), 0);
  for (const auto& [twin, known] : twins) {
    flights.twice.emplace_back(flights.paths[twin], flights.paths[known]);
    left[twin] = 1;
  }
  const auto keep = [&](auto& list) {
    std::size_t k = 0;
    std::erase_if(list, [&](auto&) { return left[k++] != 0; });
  };
  if (twins.empty()) return;
  keep(flights.paths);
  keep(flights.observed);
  keep(flights.rooms);
  keep(flights.group);
  keep(flights.logs);
}

}  // namespace

bool is_autopilots_log(const std::string& path) {
  const auto kind = log::recording_of(path);
  return kind && (*kind)->form == log::RecordingKind::Form::autopilot;
}

log::FlightLog read_flight(const std::string& path) {
  const auto* kind = read_or_fail(log::recording_of(path));
  if (kind->form == log::RecordingKind::Form::table) return read_table(path, "t_s");
  return read_or_fail(log::read_recording(path));
}

log::FlightLog read_told(const std::string& path, LogNotes& notes) {
  auto log = read_flight(path);
  for (const auto& what : log.notes) notes.column(path, what);
  return log;
}

log::FlightLog read_studied(const std::string& path, LogNotes& notes) {
  auto log = read_told(path, notes);
  for (const char* name : {"x_m", "y_m", "z_m"})
    if (!log.has(name))
      throw Failure(kBadData, path + ":1: no column '" + name + "'; a study needs positions x_m, y_m, z_m");
  for (const auto& name : log::silent_columns(log)) log.columns.erase(name);
  if (is_autopilots_log(path)) return log;
  const auto left_out = log::leave_out_doubted(log);
  if (!left_out) throw Failure(kBadData, path + ":1: " + left_out.error());
  for (const auto& what : *left_out) notes.column(path, what);
  return log;
}

Room::Room(std::string map, const Model& model)
    : name(std::move(map)),
      grid(name.empty() ? std::nullopt : std::optional(read_map(name))),
      surroundings(grid ? &*grid : nullptr, model) {}

StudiedFlight look_at(const std::string& path, std::size_t room, const std::string& group, const LookedWith& with,
                      std::vector<log::FlightLog>* keep) {
  progress("reading " + path);
  auto log = read_studied(path, with.notes);
  if (!group.empty() && (!log.has(group) || log.column(group).empty()))
    throw Failure(kBadData, path + ":1: no column '" + group + "' to group flights by; name one that it has");
  Room& in = with.rooms[room];
  std::optional<study::MapShare> place;
  if (in.grid) {
    place = study::map_share(log, *in.grid, with.vehicle);
    with.notes.place({path, in.name, *place});
  }
  study::Observer observer(with.vehicle, in.surroundings);
  observer.add(log);
  StudiedFlight flight{path, group.empty() ? 0 : log.column(group).front(), log::FlightMark(log), observer.take(), room,
                       place};
  if (keep) keep->push_back(std::move(log));
  return flight;
}

Flights each_once(std::vector<StudiedFlight> studied, bool grouped, std::vector<log::FlightLog> logs) {
  Flights flights;
  std::vector<log::FlightMark> marks;
  for (auto& flight : studied) {
    flights.paths.push_back(std::move(flight.path));
    flights.observed.push_back(std::move(flight.observed));
    flights.rooms.push_back(flight.room);
    if (grouped) flights.group.push_back(flight.group);
    marks.push_back(std::move(flight.mark));
  }
  flights.logs = std::move(logs);
  const auto twins_of = [](const std::vector<std::size_t>& same, const std::vector<std::size_t>& order) {
    std::vector<std::pair<std::size_t, std::size_t>> twins;
    for (std::size_t f = 0; f < same.size(); ++f)
      if (same[f] != f) twins.emplace_back(order[f], order[same[f]]);
    return twins;
  };
  std::vector<std::size_t> as_given(marks.size());
  std::iota(as_given.begin(), as_given.end(), std::size_t{0});
  leave_out(flights, twins_of(log::same_flights(marks), as_given));
  const auto order = flights.order();
  std::vector<study::Gusts> gusts;
  for (const std::size_t k : order) gusts.push_back(study::gusts_of(flights.observed[k].seen, 0));
  leave_out(flights, twins_of(study::same_gusts(std::move(gusts)), order));
  return flights;
}

std::vector<std::size_t> Flights::order() const {
  std::vector<std::size_t> order(paths.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (!group.empty())
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return group[a] < group[b]; });
  return order;
}

std::vector<std::string> Flights::names() const {
  std::vector<std::string> names;
  for (const std::size_t k : order()) names.push_back(paths[k]);
  return names;
}

void keep_pages() {
  ::mallopt(M_MMAP_THRESHOLD, 1 << 30);
  ::mallopt(M_TRIM_THRESHOLD, 1 << 30);
}

study::Observations observations(Flights& flights, const LookedWith& with) {
  const auto order = flights.order();
  study::Observer observer(with.vehicle, with.rooms.front().surroundings);  // they differ in nothing that is asked here
  std::size_t windows = 0;
  for (const std::size_t k : order) windows += flights.observed[k].seen.windows.size();
  observer.expect(windows);
  for (const std::size_t k : order) observer.add(std::exchange(flights.observed[k], {}));
  ::malloc_trim(0);  // what ten thousand flights held in small pieces: 0.6 GiB that nothing else fits into
  auto seen = observer.finish();
  if (flights.group.empty()) return seen;
  std::vector<double> by_flight;
  by_flight.reserve(order.size());
  for (const std::size_t k : order) by_flight.push_back(flights.group[k]);
  seen.group(by_flight);
  return seen;
}

}  // namespace backwash::services
