// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/map/scan.hpp"
#include "services/backwashd/map_news.hpp"

namespace backwash::daemon {

bool same_place(const map::OccupancyGrid& a, const map::OccupancyGrid& b);

/// What differs between two grids of the same place.
map::ScanChange difference(const map::OccupancyGrid& before, const map::OccupancyGrid& after);

/// As if a scan had found the newly occupied voxels of a change.
NewVoxels as_new_voxels(const map::OccupancyGrid& before, const map::ScanChange& change, std::int64_t received_ns);

}  // namespace backwash::daemon
