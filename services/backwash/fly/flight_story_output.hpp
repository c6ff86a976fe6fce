// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "services/backwash/fly/flight_story.hpp"
#include "services/backwash/json.hpp"

namespace backwash::services {

/// JSON of `backwash report` for any flight (docs/interfaces.md, "backwash report"); the names of a flight that `fly`
/// tells too are the same.
Json to_json(const FlightStory& story, const std::string& log);
/// The same for people, on stdout.
void print_text(const FlightStory& story, const std::string& log);

/// Why the flight was not good, the gravest first; what a piece was, and how it ended.
std::string why(const FlightStory& story);
std::string name_of(const StoryPiece& piece);
std::string end_of(const StoryPiece& piece);
/// Clearances, and what was not judged; whether the daemon's decisions follow from what it was told.
std::string clearances_of(const FlightStory& story);
std::string replay_of(const FlightStory& story);
/// By what a stretch was judged, or why it was not; what came of a mapper's window, empty without one.
std::string by_of(const JudgedStretch& stretch);
std::string window_of(const JudgedMaps& maps);

}  // namespace backwash::services
