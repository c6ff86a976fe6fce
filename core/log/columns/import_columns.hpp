// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "core/log/columns/axes.hpp"
#include "core/log/columns/column_law.hpp"
#include "core/log/columns/flight_log.hpp"
#include "core/log/columns/foreign_table.hpp"

namespace backwash::log {

/// How a table of somebody else's becomes a flight log (docs/interfaces.md, "Column map").
struct ColumnMap {
  struct Source {
    std::string name;  ///< their column
    std::string unit;  ///< of theirs; empty: as the table states it, else ours
  };
  std::map<std::string, Source> columns;  ///< our column → theirs
  std::optional<Turn> world, body;        ///< ours by theirs; nothing: not said, taken as z up and as x forward, z up
  bool world_to_body = false;             ///< their attitude turns vectors of the world into the body's
};

/// How many of our unit one `unit` of theirs is, for our column: (x_m, "mm") is 0.001. Nothing: not a unit of it.
std::optional<double> unit_factor(const std::string& column, const std::string& unit);
/// The units that a column may be given in, ours first; empty for a name that is no column of a column map.
std::vector<std::string> units_of(const std::string& column);
/// Every column that a column map may name.
std::vector<std::string> mappable_columns();
/// Every unit of some column, once.
std::vector<std::string> all_units();
/// Those of which a column map names all or none: the axes of a vector, the parts of an attitude, the rotors.
std::vector<std::vector<std::string>> column_families();

/// Reads a table (read_foreign_table) by a column map: SI units, z-up world, body x forward, y left, z up. Rows as of
/// in_their_axes() (table_rows.hpp). Attitude: qw … qz, or roll, pitch, yaw (z-y-x). Acceleration: ax_mps2 …, or
/// specific_force_x … turned by the attitude, gravity taken off. Velocity and acceleration that the table lacks are
/// local_cubics_but_for_holds'. What was left out, and how much, is in the log's notes. Errors: as read_foreign_table
/// and in_their_axes; stamps that go back; fewer than 20 rows a second or more than 5000 (the unit of the time?);
/// specific force without attitude; axes that are not up as the map says, or that neither the map nor the flight tells
/// (wrong_axes()); what physics contradicts as a whole. A column that it contradicts alone is left out
/// (leave_out_doubted()); a velocity or an acceleration that lost a column so is then of the positions.
tl::expected<FlightLog, LogError> import_columns(const std::string& path, const ColumnMap& map);
/// Which keys a map needs before its world and its body are up as the flight or the map itself says; empty: none.
std::string wrong_axes(const FlightLog& theirs, const ColumnMap& map);
/// Such a log in our axes with velocity and acceleration, whatever physics says of it. Error: why it cannot be made.
tl::expected<FlightLog, std::string> in_our_axes(FlightLog log, const ColumnMap& map);

/// Which axes are up of a flight log whose own are not (3-11), and what turns it; empty: z is, or it does not tell.
std::string turned_axes(const FlightLog& log);

/// What in a log cannot be: velocity is not the derivative of position, acceleration not that of velocity, gravity is
/// still in it, the attitude does not tilt where the craft accelerates or is none, thrust is no share of 1, columns are
/// 0 in every row while the craft moves. Axes are judged by doubts_of(): what the flight did not move says nothing.
std::vector<ColumnDoubt> contradictions(const FlightLog& log);
/// Takes doubted columns out of a log and tells each in a sentence. Refused, with what would be right: a log that is in
/// doubt as a whole (ColumnDoubt::whole), and stamps that do not rise or are no seconds.
tl::expected<std::vector<std::string>, std::string> leave_out_doubted(FlightLog& log);

/// The columns of sensors that never spoke: the rpm, the motors' commands, the thrust or the battery, 0 in every row.
std::vector<std::string> silent_columns(const FlightLog& log);

}  // namespace backwash::log
