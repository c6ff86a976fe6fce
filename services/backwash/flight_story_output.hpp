// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "services/backwash/flight_story.hpp"
#include "services/backwash/json.hpp"

namespace backwash::services {

/// JSON of `backwash report` for any flight (docs/interfaces.md, "backwash report"); the names of a flight that `fly`
/// tells too are the same.
Json to_json(const FlightStory& story, const std::string& log);
/// The same for people, on stdout.
void print_text(const FlightStory& story, const std::string& log);
/// The same as a self-contained HTML page, why the flight was not good first. `map`: what the path is drawn over; null:
/// nothing. Throws Failure 69 where gnuplot cannot draw.
std::string story_page(const FlightStory& story, const map::OccupancyGrid* map, const std::string& log);

}  // namespace backwash::services
