// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/map/occupancy_grid.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {

/// `map info`, below the verb `map`.
Verb map_info_verb(Command& group);

/// What a map's voxels are, and the area between free and unknown ones, the map's outside among these, m².
struct CellCount {
  std::size_t free = 0, occupied = 0, unknown = 0;
  double open_m2 = 0;
};
CellCount count_cells(const map::OccupancyGrid& grid);

/// Resolution, box and counts, as docs/interfaces.md names them.
Json extent_json(const map::OccupancyGrid& grid, const CellCount& count);
/// The same in lines on stdout.
void print_extent(const map::OccupancyGrid& grid, const CellCount& count);

}  // namespace backwash::services
