// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "core/map/lattice.hpp"
#include "core/map/voxel_box.hpp"

namespace backwash::map {

/// A grid in cubes of 2^kShift voxels an edge, each with one immutable Tile. A copy shares them all, so that snapshots
/// of a map that changed in one place hold the rest once. Tiles are replaced, never written; what is read from one copy
/// does not change with another.
template <class Tile, int kShift>
class Tiles {
 public:
  static constexpr int kEdge = 1 << kShift;
  /// Every tile of a grid of that size, in voxels, > 0, is `all`.
  Tiles(const Index3& size, std::shared_ptr<const Tile> all)
      : size_(size),
        count_((size.array() - 1) / kEdge + 1),
        tiles_(static_cast<std::size_t>(count_.prod()), std::move(all)) {}

  const Index3& size() const noexcept { return size_; }     // of the grid
  const Index3& counts() const noexcept { return count_; }  // of the tiles along each axis
  std::size_t count() const noexcept { return tiles_.size(); }
  /// The tile that holds a voxel inside the grid. Real-time: wait-free, no allocation.
  std::size_t holding(const Index3& v) const noexcept {
    return linear(count_, {v.x() >> kShift, v.y() >> kShift, v.z() >> kShift});
  }
  const Tile& operator[](std::size_t tile) const noexcept { return *tiles_[tile]; }
  const Tile& of(const Index3& v) const noexcept { return *tiles_[holding(v)]; }
  /// The tiles of a row of voxels along x: that of the voxel i of the row at [i >> kShift]. Precondition: the row is in
  /// the grid. Real-time: wait-free, no allocation.
  const std::shared_ptr<const Tile>* row(int j, int k) const noexcept { return &tiles_[holding({0, j, k})]; }
  void replace(std::size_t tile, std::shared_ptr<const Tile> by) noexcept { tiles_[tile] = std::move(by); }

  /// Position of a voxel in the cells of a whole tile: x runs fastest.
  static std::size_t within(const Index3& v) noexcept {
    const auto part = [](int n, int axis) { return static_cast<std::size_t>(n & (kEdge - 1)) << axis * kShift; };
    return part(v.x(), 0) | part(v.y(), 1) | part(v.z(), 2);
  }
  /// The voxels of a tile that are inside the grid.
  VoxelBox voxels(std::size_t tile) const noexcept {
    const int n = static_cast<int>(tile);
    const Index3 t(n % count_.x(), n / count_.x() % count_.y(), n / (count_.x() * count_.y()));
    return {t * kEdge, (t * kEdge + Index3::Constant(kEdge - 1)).cwiseMin(size_ - Index3::Ones())};
  }
  /// The tiles that hold a voxel of a box; the box may reach beyond the grid.
  std::vector<std::size_t> meeting(const VoxelBox& box) const {
    std::vector<std::size_t> found;
    const Index3 low = box.low.cwiseMax(0), high = box.high.cwiseMin(size_ - Index3::Ones());
    if ((low.array() > high.array()).any()) return found;
    for (int k = low.z() >> kShift; k <= high.z() >> kShift; ++k)
      for (int j = low.y() >> kShift; j <= high.y() >> kShift; ++j)
        for (int i = low.x() >> kShift; i <= high.x() >> kShift; ++i) found.push_back(linear(count_, {i, j, k}));
    return found;
  }

 private:
  Index3 size_, count_;
  std::vector<std::shared_ptr<const Tile>> tiles_;
};

}  // namespace backwash::map
