// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "services/backwash/learn/study_flights.hpp"

// What a study keeps of each log, a line of JSON each: made anywhere, studied in one place (docs/interfaces.md,
// "backwash study").
namespace backwash::services {

/// Files that logs are looked at with, as on the command line, and the column that groups them; empty: none.
struct RowsOf {
  std::string vehicle, model, group;
  std::vector<std::string> maps;
};

/// The line of one log, with its newline.
std::string study_row(const StudiedFlight& flight, const RowsOf& of);

/// Reads such lines. Throws Failure: 66, or 65 with file and line for what is no such line, or was made with
/// another program, vehicle, model, map or group.
std::vector<StudiedFlight> read_study_rows(const std::string& path, const RowsOf& of);

}  // namespace backwash::services
