// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>

#include "core/map/occupancy_grid.hpp"
#include "core/report/page/page_data.hpp"

namespace backwash::report {

/// Axes, tics and grid of every figure.
inline constexpr const char* kAxes =
    "set tics out nomirror\nset border 3 linecolor '#444444'\nset grid linecolor '#e4e4e4' linetype 1\n";

/// gnuplot data blocks $occupied and $unknown with the cells between two voxels (inclusive) seen from above: a column
/// is occupied if it is so anywhere between the heights z_low and z_high (m), else unknown if it is so anywhere. Runs
/// along x are merged into one rectangle (x, y, x_low, x_high, y_low, y_high).
std::string cell_blocks(const map::OccupancyGrid& grid, const Index3& first, const Index3& last, double z_low,
                        double z_high);

/// Ranges and scale of a figure that shows those cells from above: metres equal on both axes.
std::string view_from_above(const map::OccupancyGrid& grid, const Index3& first, const Index3& last);

/// gnuplot data block $name of the sets from above, grown by `radius` (m): a closed outline each, at least 1 cm apart.
std::string outlines(const std::string& name, std::span<const Prism> tube, double radius);

/// Parts of a plot command that draw such blocks as a band, so that only the border of their union remains, a comma at
/// its end.
std::string plot_band(const std::string& name, const std::string& fill, const std::string& border,
                      const std::string& title);

/// The part of a plot command that draws those blocks, a comma at its end.
std::string plot_cells();

}  // namespace backwash::report
