// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "core/log/columns/flight_log.hpp"

namespace backwash::log {

/// A table that another program wrote, by column.
struct ForeignTable {
  struct Column {
    std::string name;            ///< unique; "column 3" of one without
    std::string unit = {};       ///< that the table states, as units_of() calls it; empty: none, or one not known
    std::vector<double> values;  ///< a row each; NaN: a gap
    std::size_t text_line = 0;   ///< of the first cell that is no number; 0: none
    std::string text;            ///< in that cell
    bool dates = false;          ///< its cells are dates with times of day: s since 1970
  };
  std::vector<Column> columns;
  bool named = false;  ///< whether it has a header
  const Column* find(const std::string& name) const;
  std::string names() const;  ///< as a list
};

/// Name of the column that read_foreign_table makes of frame numbers and a stated rate.
inline constexpr const char* kFrameTime = "frame/rate";

/// Reads a table by what is in it, whatever its suffix and compression: cells between tabs, semicolons, commas or
/// blanks; decimal commas; a header of no, one or several lines (programs for motion capture put object, quantity and
/// unit into lines of their own) below any preamble. A name that is there twice takes what stands above it. Units:
/// "name [unit]", "name (unit)", "name_unit" or a line of units. Where frames are counted and a rate is stated, but no
/// time, the column kFrameTime is their quotient, s. Errors: as read_log_file; no three rows of numbers one below the
/// other; a row with another number of cells.
tl::expected<ForeignTable, LogError> read_foreign_table(const std::string& path);

/// A unit as people write it, as units_of() calls it: "m s^-1" → "m/s". Empty: not known.
std::string unit_called(const std::string& text);
/// The unit that a name ends with: "x_cm" → "cm". Empty: with none.
std::string unit_in_name(const std::string& name);

}  // namespace backwash::log
