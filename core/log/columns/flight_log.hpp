// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <set>
#include <string>
#include <tl/expected.hpp>
#include <vector>

namespace backwash::log {

/// A flight log by column (docs/interfaces.md, "Flight log, CSV"): SI units, world frame z-up. Columns that a log lacks
/// are absent from the map, never zero.
struct FlightLog {
  std::vector<double> t_s;
  std::map<std::string, std::vector<double>> columns;  ///< name as in the file → one value per row
  std::vector<std::string> notes = {};  ///< what its reader could not read or left out, and how much: a sentence each
  bool has(const std::string& name) const { return columns.contains(name); }
  const std::vector<double>& column(const std::string& name) const { return columns.at(name); }
};

/// One line: FILE:LINE: what is wrong and what would be right.
struct LogError {
  enum class Kind { not_found, bad_data, cannot_create } kind;
  std::string message;
};

/// Reads numbers between commas, or between what semicolons or tabs its first line has, under that line of names.
/// Errors: missing file, no t_s column (unless `time_column` names another or is empty), a duplicated name, a row with
/// too few or too many cells, a cell that is not a finite number. Columns named in `unread` are left out, whatever
/// their cells hold. With `gaps`, a cell that is empty or nan is NaN. A file that gzip made is read as what is in it.
tl::expected<FlightLog, LogError> read_csv(const std::string& path, const std::string& time_column = "t_s",
                                           const std::set<std::string>& unread = {}, bool gaps = false);

/// The names in a CSV file's first line, in its order. Errors: missing file, a name that is empty.
tl::expected<std::vector<std::string>, LogError> csv_names(const std::string& path);

/// Writes t_s first, then the columns in name order, with enough digits to read back bit for bit.
tl::expected<void, LogError> write_csv(const std::string& path, const FlightLog& log, bool overwrite);

}  // namespace backwash::log
