// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/plan/world/world.hpp"
#include "services/backwash/fly/flight_story.hpp"

namespace backwash::services {

/// What a page says beside the story.
struct StoryContext {
  std::string log;     ///< as given
  double body_radius;  ///< m
  std::vector<std::pair<std::string, std::string>> parameters;
  const plan::World* world = nullptr;  ///< of the map, for the field; null: none is shown
};
/// The same as a self-contained HTML page, why the flight was not good first. `map`: what the path is drawn over; null:
/// nothing.
std::string story_page(const FlightStory& story, std::span<const log::RawRecord> log, const map::OccupancyGrid* map,
                       const StoryContext& context);

}  // namespace backwash::services
