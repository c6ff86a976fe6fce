// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "core/map/occupancy_grid.hpp"
#include "core/plan/motion_primitive.hpp"

namespace backwash::plan {

/// The voxels a search may pass, with O(1) box queries by a summed-area table. Outside the grid nothing may be passed.
class SafeSpace {
 public:
  /// `passable`: one entry per voxel of the grid (linear order), 0: may not be passed. O(voxels).
  SafeSpace(const map::OccupancyGrid& grid, std::vector<std::uint8_t> passable);

  double resolution() const noexcept { return resolution_; }
  const Vec3& origin() const noexcept { return origin_W_; }
  /// Voxel that contains p; may lie outside.
  Index3 index(const Vec3& p_W) const noexcept { return ((p_W - origin_W_) / resolution_).array().floor().cast<int>(); }
  bool passable(const Index3& v) const noexcept;
  /// Whether every voxel that meets the closed box may be passed.
  bool clear(const Box& box) const noexcept;
  /// Whether every voxel the motion meets may be passed: pieces with exact bounds, halved until their box is clear or
  /// smaller than a quarter of a voxel. Never true for a motion that touches a voxel that may not be passed.
  bool clear(const Motion& motion) const noexcept;

  /// Number of king's moves (26 neighbours) through passable voxels from each voxel to `goal`; kUnreached where there
  /// is no way. Any motion through passable voxels whose fastest axis covers S metres in total makes fewer than
  /// S/resolution + 1 of them: |Δp| ≤ a on each axis changes each index by at most 1.
  static constexpr std::uint32_t kUnreached = 0xffffffffu;
  std::vector<std::uint32_t> hops_to(const Index3& goal) const;
  std::size_t linear(const Index3& v) const noexcept {
    return static_cast<std::size_t>(v.x() + size_.x() * (v.y() + size_.y() * v.z()));
  }

 private:
  std::uint32_t blocked_below(int i, int j, int k) const noexcept {
    return blocked_[static_cast<std::size_t>(i + (size_.x() + 1) * (j + (size_.y() + 1) * k))];
  }
  Vec3 origin_W_;
  double resolution_;
  Index3 size_;
  std::vector<std::uint8_t> passable_;
  std::vector<std::uint32_t> blocked_;  // blocked voxels in [0, i) × [0, j) × [0, k)
};

}  // namespace backwash::plan
