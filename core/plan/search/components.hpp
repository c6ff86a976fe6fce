// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/map/tiles.hpp"

namespace backwash::plan {

/// The connected components of a grid's free voxels, which share faces. Each tile of 16³ voxels numbers its own parts;
/// a table says which component a part belongs to. So a change numbers few tiles anew, and copies share the others.
class Components {
 public:
  static constexpr std::uint32_t kNone = 0;
  /// O(voxels).
  explicit Components(const map::OccupancyGrid& free);
  /// Takes over what changed in `free` within a box inside it. O(voxels of the tiles met + joints of all tiles).
  void update(const map::OccupancyGrid& free, const map::VoxelBox& changed);

  /// The region of a voxel inside the grid, from 1; kNone: it is not free. Free voxels that share faces have the same
  /// one; those of two numbers are not joined. Parts beyond the 255th of one tile count as joined.
  /// Real-time: wait-free, no allocation.
  std::uint32_t of(const Index3& v) const noexcept {
    const std::size_t tile = tiles_.holding(v);
    return component_[first_[tile] + tiles_[tile].part[Grid::within(v)]];
  }
  /// Whether a voxel inside the grid is free. Real-time: wait-free, no allocation.
  bool free(const Index3& v) const noexcept { return tiles_.of(v).part[Grid::within(v)] != 0; }

 private:
  static constexpr int kShift = 4;
  struct Joint {
    std::uint8_t axis, part, beyond;  // a part of the tile, and one of the tile above along the axis that it touches
  };
  struct Tile {
    std::array<std::uint8_t, std::size_t{1} << 3 * kShift> part{};  // 0: not free
    std::uint8_t parts = 0;
    std::vector<Joint> joints{};
  };
  using Grid = map::Tiles<Tile, kShift>;
  static Tile numbered(const map::OccupancyGrid& free, const map::VoxelBox& voxels);
  std::vector<Joint> joints_of(std::size_t tile) const;
  void join();

  Grid tiles_;
  std::vector<std::uint32_t> first_;      // per tile: of its parts in component_, whose number 0 is kNone
  std::vector<std::uint32_t> component_;  // per tile and part
};

}  // namespace backwash::plan
