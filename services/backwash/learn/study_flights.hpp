// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/log/autopilot/same_flight.hpp"
#include "core/log/columns/flight_log.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/study/windows/observed.hpp"
#include "core/types/model.hpp"
#include "core/types/vehicle.hpp"
#include "services/backwash/learn/log_notes.hpp"

namespace backwash::services {

/// PX4's or ArduPilot's own log, by its content.
bool is_autopilots_log(const std::string& path);

/// A flight log of any kind that its content says (log::recording_of). Throws Failure.
log::FlightLog read_flight(const std::string& path);
/// The same; `notes` tell what its reader could not read or left out.
log::FlightLog read_told(const std::string& path, LogNotes& notes);

/// The same for a study, which needs positions: without the columns of sensors that never spoke, and without the
/// gaps of a table (core/log, leave_out_gaps()) and what in it the rest contradicts (leave_out_doubted()), which
/// `notes` then tell. Throws Failure.
log::FlightLog read_studied(const std::string& path, LogNotes& notes);

/// What is seen of one log. Throws Failure where it is too short for one window.
study::Observed observed(const std::string& path, const log::FlightLog& log, const Vehicle& vehicle,
                         study::MapView& surroundings);

/// A place that flights were flown in, and what was seen of it. Without a map nothing but the floor.
struct Room {
  Room(std::string map, const Model& model);
  Room(const Room&) = delete;
  const std::string name;  ///< its map as on the command line; empty: none
  const std::optional<map::OccupancyGrid> grid;
  study::MapView surroundings;
};

/// What flights are looked at with. Nothing here outlives the study.
struct LookedWith {
  const Vehicle& vehicle;
  std::deque<Room>& rooms;  ///< one or more: all of maps, or one without
  LogNotes& notes;
};

/// What a study keeps of one log.
struct StudiedFlight {
  std::string path;
  double group = 0;  ///< value of the column that flights are grouped by in the first row
  log::FlightMark mark;
  study::Observed observed;
  std::size_t room;                           ///< which of the rooms
  std::optional<study::MapShare> place = {};  ///< with a map
};
/// Reads a log of a room and looks at it. `group`: a column, or empty. `keep`: takes the log. Throws Failure, also
/// where too much of the flight lies where the map lets no craft be.
StudiedFlight look_at(const std::string& path, std::size_t room, const std::string& group, const LookedWith& with,
                      std::vector<log::FlightLog>* keep);

/// The flights of a study, each once.
struct Flights {
  std::vector<std::string> paths;
  std::vector<study::Observed> observed;
  std::vector<std::size_t> rooms;
  std::vector<double> group;  ///< empty: none
  std::vector<log::FlightMark> marks;
  std::vector<log::FlightLog> logs;                        ///< where they are kept
  std::vector<std::pair<std::string, std::string>> twice;  ///< left out, and which flight it is again
  /// Numbers of the flights, those of one group behind each other.
  std::vector<std::size_t> order() const;
  /// Their logs in this order.
  std::vector<std::string> names() const;
};

/// To be called first. Columns of thousands of flights come and go thousands of times: the kernel need not clear their
/// pages each time.
void keep_pages();

/// Leaves out flights that hold another one's positions, then those with another one's gusts. `logs`: of each, or
/// empty.
Flights each_once(std::vector<StudiedFlight> studied, bool grouped, std::vector<log::FlightLog> logs);
/// Flights known to be sound, each once and none that is judged as well: those are told with `flights`. Nothing without
/// such. Throws Failure.
std::optional<study::Observations> sound_flights(const std::vector<std::string>& paths, const LookedWith& with,
                                                 const Model& model, Flights& flights);
/// All of them as one: takes what was observed out of `flights`.
study::Observations observations(Flights& flights, const LookedWith& with);

}  // namespace backwash::services
