// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/map/occupancy_grid.hpp"
#include "core/report/page/chart.hpp"
#include "core/study/calibrate/fit.hpp"

namespace backwash::study::calibrate {

/// Raw variances of the windows of one map along a world axis (dots) and the bound (lines) over y, for the lowest, the
/// middle and the highest third of the hovers (the paper's hover figure). A line is the bound at its third's mean x and
/// height. A field evaluation per 0.1 m and line.
report::Chart bound_chart(const Data& data, const Model& model, int axis, const map::OccupancyGrid& grid,
                          std::size_t place);

}  // namespace backwash::study::calibrate
