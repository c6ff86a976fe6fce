// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/study/windows/map_share.hpp"
#include "services/backwash/json.hpp"

namespace backwash::services {

/// What is told of the logs of one call before anything is concluded from them.
struct LogNotes {
  std::string verb;                                          ///< "backwash study": begins each line on stderr
  std::vector<std::pair<std::string, std::string>> columns;  ///< log, and what of it is not believed
  std::vector<std::pair<std::string, std::string>> logs;     ///< left out, and why
  struct Place {
    std::string log, map;
    study::MapShare share;
  };
  std::vector<Place> places;  ///< of each log with a map, also of those left out

  /// A column is left out: on stderr at once. `what`: one sentence.
  void column(const std::string& log, const std::string& what);
  /// A log is left out: on stderr at once. `why`: with the log's name.
  void left_out(const std::string& log, const std::string& why);
  /// Notes the share of a log in its map. Throws Failure 65 where it is too large.
  void place(const Place& place);
};

/// Calls `read` for each log. One that throws bad data is left out, told on stderr at once. Throws Failure 65
/// if none is left, and any that is not bad data, such as a file that is not there.
void each_readable(const std::vector<std::string>& logs, LogNotes& notes,
                   const std::function<void(const std::string& log)>& read);

/// `json` with what is told before its own keys: map_shares, then left_out and columns_left_out, none that is empty.
Json told_first(const LogNotes& notes, const Json& json);
/// Where the flights lie in the map, on stdout: one line, and one of each flight that is not wholly where it may be.
void print_text(const LogNotes& notes);
/// All of it as a section of a page; empty if there is nothing.
std::string html(const LogNotes& notes);

}  // namespace backwash::services
