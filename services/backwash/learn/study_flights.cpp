// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/learn/study_flights.hpp"

#include <malloc.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/log/columns/import_columns.hpp"
#include "core/log/columns/log_columns.hpp"
#include "core/log/kinds/recording.hpp"
#include "core/log/raw/raw_flight.hpp"
#include "core/study/windows/observer.hpp"
#include "core/study/windows/signals/same_gusts.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/plan/logged_vehicle.hpp"
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
  keep(flights.marks);
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
  if (is_autopilots_log(path) || log.t_s.size() < 2) return log;
  if (const auto turned = log::turned_axes(log); !turned.empty()) throw Failure(kBadData, path + ":1: " + turned);
  return log;
}

log::FlightLog read_studied(const std::string& path, LogNotes& notes) {
  const bool table = read_or_fail(log::recording_of(path))->form == log::RecordingKind::Form::table;
  auto log = table ? read_table(path, "t_s", true) : read_told(path, notes);
  for (const auto& what : log::leave_out_gaps(log)) notes.column(path, what);
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

study::Observed observed(const std::string& path, const log::FlightLog& log, const Vehicle& vehicle,
                         study::MapView& surroundings) {
  study::Observer observer(vehicle, surroundings);
  observer.add(log);
  auto all = observer.take();
  if (all.seen.windows.empty() && all.seen.gated_out.empty())
    throw Failure(kBadData, path + ":1: " + std::to_string(log.t_s.size()) +
                                " rows are no flight: there is no window of 2 s in them");
  return all;
}

Room::Room(std::string map, const Model& model)
    : name(std::move(map)),
      grid(name.empty() ? std::nullopt : std::optional(read_map(name))),
      surroundings(grid ? &*grid : nullptr, model) {}

StudiedFlight look_at(const std::string& path, std::size_t room, const std::string& group, const LookedWith& with,
                      std::vector<log::FlightLog>* keep) {
  progress("reading " + path);
  auto log = read_studied(path, with.notes);
  if (const auto other = another_vehicle(log, with.vehicle); !other.empty()) with.notes.column(path, other);
  if (!group.empty() && (!log.has(group) || log.column(group).empty()))
    throw Failure(kBadData, path + ":1: no column '" + group + "' to group flights by; name one that it has");
  Room& in = with.rooms[room];
  auto all = observed(path, log, with.vehicle, in.surroundings);
  std::optional<study::MapShare> place;
  if (in.grid) {
    place = study::map_share(log, *in.grid, with.vehicle);
    with.notes.place({path, in.name, *place});
  }
  StudiedFlight flight{path, group.empty() ? 0 : log.column(group).front(), log::FlightMark(log), std::move(all), room,
                       place};
  if (keep) keep->push_back(std::move(log));
  return flight;
}

Flights each_once(std::vector<StudiedFlight> studied, bool grouped, std::vector<log::FlightLog> logs) {
  Flights flights;
  for (auto& flight : studied) {
    flights.paths.push_back(std::move(flight.path));
    flights.observed.push_back(std::move(flight.observed));
    flights.rooms.push_back(flight.room);
    if (grouped) flights.group.push_back(flight.group);
    flights.marks.push_back(std::move(flight.mark));
  }
  flights.logs = std::move(logs);
  const auto twins_of = [](const std::vector<std::size_t>& same, const std::vector<std::size_t>& order) {
    std::vector<std::pair<std::size_t, std::size_t>> twins;
    for (std::size_t f = 0; f < same.size(); ++f)
      if (same[f] != f) twins.emplace_back(order[f], order[same[f]]);
    return twins;
  };
  std::vector<std::size_t> as_given(flights.marks.size());
  std::iota(as_given.begin(), as_given.end(), std::size_t{0});
  leave_out(flights, twins_of(log::same_flights(flights.marks), as_given));
  const auto order = flights.order();
  std::vector<study::Gusts> gusts;
  for (const std::size_t k : order) gusts.push_back(study::gusts_of(flights.observed[k].seen, 0));
  leave_out(flights, twins_of(study::same_gusts(std::move(gusts)), order));
  return flights;
}

std::optional<study::Observations> sound_flights(const std::vector<std::string>& paths, const LookedWith& with,
                                                 const Model& model, Flights& flights) {
  if (paths.empty()) return std::nullopt;
  study::MapView nowhere(nullptr, model);
  study::Observer observer(with.vehicle, nowhere);
  auto marks = flights.marks;
  auto names = flights.paths;
  each_readable(paths, with.notes, [&](const auto& path) {
    const auto log = read_studied(path, with.notes);
    const log::FlightMark mark(log);
    const auto same = std::ranges::find_if(marks, [&](auto& m) { return m.shared(mark) >= log::kSameFlight; });
    if (same != marks.end()) {
      flights.twice.emplace_back(path, names[static_cast<std::size_t>(same - marks.begin())]);
      return;
    }
    observer.add(observed(path, log, with.vehicle, nowhere));
    marks.push_back(mark);
    names.push_back(path);
  });
  return observer.finish();
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
