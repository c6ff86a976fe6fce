// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "core/map/occupancy_grid.hpp"

namespace backwash::map {

/// The bytes of a binary OctoMap file (`.bt`): OctoMap's header, then the pruned tree of encode_octomap. A grid without
/// known cells gives an empty tree, which no reader takes. O(cells). Precondition and error as encode_octomap.
std::string octomap_file(const OccupancyGrid& grid);

}  // namespace backwash::map
