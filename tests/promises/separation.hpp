// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/map/occupancy_grid.hpp"
#include "core/types/geometry.hpp"

namespace backwash::promises {

/// Oracle of distances: shapes as points, voxels as boxes, one look at each voxel that is not free. Shares nothing with
/// core/reach/clearance.

/// Corners of {center + e : |unit(d)·e| ≤ half_widths[d] for every d}, by intersecting all pairs of its sides.
std::vector<Vec3> prism_corners(const Vec3& center_W, const PerDirection& half_widths);

/// Distance from the convex hull of points to the box [low, high], m, 0 if they meet: the shortest vector of the
/// difference of both (Wolfe 1976). Within 1e-9 m.
double hull_to_box(const std::vector<Vec3>& hull, const Vec3& low, const Vec3& high);

/// The voxels of a map that are not free, and a layer of them around it: those with a face at a free one.
class Obstacles {
 public:
  explicit Obstacles(const map::OccupancyGrid& grid);
  /// Distance from the hull of points to the nearest of them, m; `limit` if none is nearer.
  double distance(const std::vector<Vec3>& hull, double limit) const;

 private:
  double edge_;
  std::vector<Vec3> low_;
};

}  // namespace backwash::promises
