// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <tl/expected.hpp>

#include "core/map/occupancy_grid.hpp"
#include "core/report/page/plot.hpp"

namespace backwash::report {

/// One layer of a map from above: occupied, unknown and free voxels at the height `z` (m, W).
tl::expected<std::string, PlotError> map_picture(const map::OccupancyGrid& grid, double z, Format format);

}  // namespace backwash::report
