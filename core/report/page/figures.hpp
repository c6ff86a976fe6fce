// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "core/map/occupancy_grid.hpp"
#include "core/report/page/plot.hpp"
#include "core/sim/flight.hpp"
#include "core/types/disturbance.hpp"

namespace backwash::report {

using Figure = tl::expected<std::string, PlotError>;

/// A plane through a map: axis 0, 1, 2 for x, y, z and where it cuts that axis, m.
struct Slice {
  int axis;
  double coordinate;
};
struct FieldSample {
  Vec3 p_W;        ///< m
  Variance sigma;  ///< (m/s²)²
};
/// Standard deviation of the disturbance along x, y and z over a slice, three panels with one colour scale in m/s².
/// `samples` lie in the slice at the centres of voxels.
Figure field_slice_figure(const map::OccupancyGrid& grid, const Slice& slice, const std::vector<FieldSample>& samples,
                          Format format);

/// The map from above with the flight: obstacles that the tube's height range meets, the tube's outline (octagons), the
/// same with the body around it, commands and the path flown.
Figure map_figure(const sim::Flight& flight, const plan::World& world);
/// Heights along the route: floor, ceiling, tube, command and flight over the distance flown along the commands.
Figure height_figure(const sim::Flight& flight, const plan::World& world);
/// w̄ along z at the mean height of a path (field_box.hpp), with the path. Precondition: it holds a point.
Figure flight_field_figure(std::span<const Vec3> path_W, const plan::World& world);

/// Corners of {e : |unit(d)·e| ≤ h_d} seen from above, relative to its centre, counter-clockwise, m.
std::vector<Vec3> octagon(const PerDirection& half_widths);

}  // namespace backwash::report
