// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "core/map/occupancy_grid.hpp"
#include "core/report/page/plot.hpp"
#include "core/study/calibrate/fit.hpp"

namespace backwash::study::calibrate {

/// One map of a figure.
struct FigurePlace {
  std::string name;
  const map::OccupancyGrid* grid;
  std::size_t place;  ///< its number in Data::place
};

/// Raw variances of the windows along a world axis (red points) under the bound (surface) over y and height, one panel
/// per map (the paper's hover figure). The surface lies in the plane of the hovers' mean x, across their range.
/// gnuplot; SVG. A field evaluation per 0.1 × 0.1 m.
tl::expected<std::string, report::PlotError> bound_figure(const Data& data, const Model& model, int axis,
                                                          std::span<const FigurePlace> places);

}  // namespace backwash::study::calibrate
