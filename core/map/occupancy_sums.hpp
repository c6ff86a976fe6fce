// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "core/map/occupancy_grid.hpp"
#include "core/map/tiles.hpp"

namespace backwash::map {

/// Summed-area tables of the voxels that are not free: whether a box of voxels holds any, in eight look-ups for each
/// cube of 128 voxels that it meets (one for 4 of 5 boxes of 10 voxels an edge). Sums are kept modulo 2¹⁶, which is
/// exact for boxes of fewer voxels (3.2 m at a = 0.08 m; larger ones are halved): 2 bytes per voxel and one layer more
/// per axis and cube. A cube's sums depend on its own voxels alone, so that a change makes few of them anew, and copies
/// share the others. Outside the grid nothing is free.
class OccupancySums {
 public:
  /// O(voxels).
  explicit OccupancySums(const OccupancyGrid& grid);
  /// Takes over what changed in `grid` within the voxels [low, high] (others as before): O(voxels of the cubes met).
  void update(const OccupancyGrid& grid, const Index3& low, const Index3& high);
  /// Whether all voxels from low to high, both included, are free; true for none (low > high in an axis). O(1) within a
  /// cube up to 2¹⁶ voxels, beyond that O(voxels / 2¹⁵ + cubes). Real-time: wait-free, no allocation.
  bool voxels_free(const Index3& low, const Index3& high) const noexcept;
  /// Whether all voxels, closed cubes, that meet the closed box [low, high] (m in W) are free: a face belongs to both
  /// of its voxels. False if low > high in an axis. Real-time: wait-free, no allocation.
  bool box_free(const Vec3& low_W, const Vec3& high_W) const noexcept;

 private:
  using Sum = std::uint16_t;
  struct Cube {
    std::size_t stride_y = 0, stride_z = 0;
    std::vector<Sum> sums;  // (i, j, k) of the cube's own: voxels not free below i, j and k
  };
  using Cubes = Tiles<Cube, 7>;
  static Cube cube_of(const OccupancyGrid& grid, const VoxelBox& voxels);
  static bool free_in(const Cube& cube, const Index3& low, const Index3& high) noexcept;  // by the cube's own indices
  static bool halves_free_in(const Cube& cube, const Index3& low, const Index3& high) noexcept;
  bool all_free(const Index3& low, const Index3& high) const noexcept;  // inside the grid, low ≤ high
  bool cubes_free(const Index3& low, const Index3& high) const noexcept;

  Vec3 origin_W_;
  double per_voxel_;  // 1/a
  Cubes cubes_;
};

}  // namespace backwash::map
