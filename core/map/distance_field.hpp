// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "core/map/occupancy_grid.hpp"
#include "core/map/shared_rows.hpp"

namespace backwash::map {

/// Distance from points to the nearest face of an occupied or unknown voxel ("obstacle" below; outside the grid is
/// unknown and therefore an obstacle), docs/model.md section 4. Stored at voxel centres, 0 inside obstacles, as squares
/// in half voxels: exact up to 127.999 voxels, and that where it is farther, so that no distance is said to be larger.
/// Copies share what is equal in them.
class DistanceField {
 public:
  /// Exact separable transform: the distance from each voxel centre to the nearest obstacle *box* (not centre), m.
  /// O(cells), times the distance in voxels over the width of a vector.
  explicit DistanceField(const OccupancyGrid& grid);
  /// Takes over what changed in `grid` within a box inside it (all else as before), bit for bit as if made anew. Only
  /// voxels no farther from the box than from their nearest obstacle are looked at again.
  void update(const OccupancyGrid& grid, const VoxelBox& changed);

  /// At a voxel's centre, m; 0 outside the grid. Real-time: wait-free, no allocation.
  double at(const Index3& v) const noexcept { return inside(squared_.size(), v) ? metres(squared_[v]) : 0.0; }
  /// Trilinear interpolation between voxel centres, m; 0 outside the grid. Off exact() by at most √3/2·a, and too large
  /// near faces (a/4 on a flat one, 0.56a on a convex corner): for gradients and search; exact() for what must hold.
  /// Real-time: wait-free, no allocation.
  double interpolated(const Vec3& p_W) const noexcept;
  /// interpolated() and its gradient, unitless; zero outside the grid. Real-time: wait-free, no allocation.
  struct Linear {
    double distance;
    Vec3 gradient;
  };
  Linear linear(const Vec3& p_W) const noexcept;
  Vec3 gradient(const Vec3& p_W) const noexcept { return linear(p_W).gradient; }
  /// Exact distance from any point to the nearest obstacle face, m: a local search bounded by at(), 0 inside obstacles
  /// and outside the grid. O((distance/a)²) rows. `grid` is the one this was built from.
  /// Real-time: wait-free, no allocation.
  double exact(const OccupancyGrid& grid, const Vec3& p_W) const noexcept;

 private:
  struct Corners {            // the eight centres around a point
    std::array<double, 8> d;  // m; bit 0: upper in x, bit 1: y, bit 2: z
    Vec3 t;                   // the point's place between them, 0 … 1
  };
  Corners corners(const Vec3& q) const noexcept;
  bool covers(const Vec3& q) const noexcept;  // q in voxels from the origin
  double metres(std::uint16_t squared) const noexcept {
    return static_cast<double>(static_cast<float>(half_voxel_ * std::sqrt(static_cast<double>(squared))));
  }

  Vec3 origin_W_;
  double resolution_, half_voxel_;
  SharedRows<std::uint16_t> squared_;
};

}  // namespace backwash::map
