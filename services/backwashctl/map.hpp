// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/map/occupancy_grid.hpp"
#include "services/backwashctl/answer.hpp"
#include "services/backwashctl/station.hpp"
#include "services/dds/map_sending.hpp"

namespace backwash::ctl {

/// What `backwashctl map` sends, and how.
struct MapOptions {
  std::string file;            ///< an OctoMap, or builtin:NAME
  std::string frame = "map";   ///< the daemon's frames.map
  double rate_kbit_s = 100e3;  ///< of the line, never exceeded
  double patience_s = 20;      ///< without a part that is newly acknowledged, until it is given up
};

/// What a transfer that was given up has come to, and what to set: one line, for people.
/// `silent_s`: since a part was last acknowledged.
std::string given_up(const dds::MapSending& sending, std::size_t bytes, double took_s, double silent_s);

/// What the daemon needs for a map beyond its default memory: one line; nothing: the default is enough.
std::optional<std::string> needs_more(const map::OccupancyGrid& grid);

/// Sends a map in parts (docs/interfaces.md, "Maps in parts") and waits until the daemon has it in use. Accepted: it
/// has; done: the same. Throws StartError 66 for a file that is missing and 65 for one that is no map.
Outcome send_map(const Options& options, const MapOptions& map, bool quiet);

}  // namespace backwash::ctl
