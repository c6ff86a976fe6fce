// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/map/occupancy_grid.hpp"

namespace backwash::map {

/// Distance from points to the nearest face of an occupied or unknown voxel ("obstacle" below; outside the grid is
/// unknown and therefore an obstacle), docs/model.md section 4. Stored at voxel centres, 0 inside obstacles.
class DistanceField {
 public:
  /// Exact separable transform: the distance from each voxel centre to the nearest obstacle *box* (not centre), m, in
  /// O(cells) per axis.
  explicit DistanceField(const OccupancyGrid& grid);

  /// At a voxel's centre, m; 0 outside the grid.
  double at(const Index3& v) const noexcept;
  /// The same by the voxel's position in the cell array; precondition: inside the grid.
  double at(std::size_t linear) const noexcept { return static_cast<double>(distance_[linear]); }
  /// Trilinear interpolation between voxel centres, m; 0 outside the grid. Off exact() by at most √3/2·a, and too large
  /// near faces (a/4 on a flat one, 0.56a on a convex corner): for gradients and search; exact() for what must hold.
  /// Real-time: wait-free, no allocation.
  double interpolated(const Vec3& p_W) const noexcept;
  /// Gradient of interpolated(), unitless; zero outside the grid. Real-time: wait-free, no allocation.
  Vec3 gradient(const Vec3& p_W) const noexcept;
  /// Exact distance from any point to the nearest obstacle face, m: a local search bounded by at(), 0 inside obstacles
  /// and outside the grid. O((distance/a)²) rows. `grid` is the one this was built from.
  /// Real-time: wait-free, no allocation.
  double exact(const OccupancyGrid& grid, const Vec3& p_W) const noexcept;

 private:
  bool covers(const Vec3& q) const noexcept;  // q in voxels from the origin

  Vec3 origin_W_;
  double resolution_;
  Index3 size_;
  std::vector<float> distance_;
};

}  // namespace backwash::map
