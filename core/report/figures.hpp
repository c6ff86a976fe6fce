// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "core/map/occupancy_grid.hpp"
#include "core/plan/world/world.hpp"
#include "core/report/page/page_data.hpp"
#include "core/sim/flight.hpp"

namespace backwash::report {

/// The part of a map between two places from above. A column is occupied if it is so anywhere between the heights z_low
/// and z_high (m), else unknown if it is so anywhere.
Chart seen_from_above(const map::OccupancyGrid& grid, const Vec3& low_W, const Vec3& high_W, double z_low,
                      double z_high);
/// A path seen from above.
Run run_of(std::span<const Vec3> path_W);
/// Sets from above, grown by `radius` (m), at least 1 cm apart.
Layer outlines(std::span<const Prism> tube, double radius, Kind kind, const std::string& name);

/// A plane through a map: axis 0, 1, 2 for x, y, z and where it cuts that axis, m.
struct Slice {
  int axis;
  double coordinate;
};
struct FieldSample {
  Vec3 p_W;        ///< m
  Variance sigma;  ///< (m/s²)²
};
/// Standard deviation of the disturbance along x, y and z over a slice, a chart each with one palette in m/s².
/// `samples` lie in the slice at the centres of voxels.
std::vector<Chart> field_slice(const map::OccupancyGrid& grid, const Slice& slice,
                               const std::vector<FieldSample>& samples);

/// The map from above with the flight: obstacles that the tube's height range meets, the tube's outline (octagons), the
/// same with the body around it, commands and the path flown.
Chart map_chart(const sim::Flight& flight, const plan::World& world);
/// Heights along the route: floor, ceiling, tube, command and flight over the distance flown along the commands.
Chart height_chart(const sim::Flight& flight, const plan::World& world);
/// w̄ along z at the mean height of a path (field_box.hpp), with the path. Precondition: it holds a point.
Chart flight_field_chart(std::span<const Vec3> path_W, const plan::World& world);

}  // namespace backwash::report
