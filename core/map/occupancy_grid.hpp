// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/map/lattice.hpp"
#include "core/types/geometry.hpp"

namespace backwash::map {

enum class Cell : std::uint8_t { unknown = 0, free = 1, occupied = 2 };

/// Voxel grid with edge a in the world frame; everything outside it is unknown (docs/model.md section 1).
class OccupancyGrid {
 public:
  /// `origin_W`: minimum corner of voxel (0, 0, 0), m. `resolution`: edge a, m, > 0. `size`: voxels along x, y, z, > 0.
  /// All cells start as `fill`.
  OccupancyGrid(const Vec3& origin_W, double resolution, const Index3& size, Cell fill = Cell::unknown);

  double resolution() const noexcept { return resolution_; }
  const Vec3& origin() const noexcept { return origin_W_; }
  const Index3& size() const noexcept { return size_; }
  std::size_t cell_count() const noexcept { return cells_.size(); }

  bool inside(const Index3& v) const noexcept { return map::inside(size_, v); }
  /// Position of a voxel in the cell array: x runs fastest. Precondition: inside(v).
  std::size_t linear(const Index3& v) const noexcept { return map::linear(size_, v); }
  Index3 voxel(std::size_t linear) const noexcept { return map::voxel(size_, linear); }

  /// The cell's content; unknown outside the grid.
  Cell at(const Index3& v) const noexcept { return inside(v) ? cells_[linear(v)] : Cell::unknown; }
  Cell at(std::size_t linear) const noexcept { return cells_[linear]; }
  /// Precondition: inside(v).
  void set(const Index3& v, Cell c) noexcept { cells_[linear(v)] = c; }

  bool free(const Index3& v) const noexcept { return at(v) == Cell::free; }
  bool occupied(const Index3& v) const noexcept { return at(v) == Cell::occupied; }

  /// Voxel that contains p (a point on a face belongs to the upper voxel); may lie outside the grid.
  Index3 index(const Vec3& p_W) const noexcept { return ((p_W - origin_W_) / resolution_).array().floor().cast<int>(); }
  /// Centre of a voxel, m in W; defined outside the grid too.
  Vec3 center(const Index3& v) const noexcept {
    return origin_W_ + resolution_ * (v.cast<double>() + Vec3::Constant(0.5));
  }
  std::span<const Cell> cells() const noexcept { return cells_; }

 private:
  Vec3 origin_W_;
  double resolution_;
  Index3 size_;
  std::vector<Cell> cells_;
};

}  // namespace backwash::map
