// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "core/map/occupancy_grid.hpp"
#include "core/map/occupancy_sums.hpp"
#include "core/plan/motion_primitive.hpp"

namespace backwash::plan {

/// The voxels a search may pass, with O(1) box queries by a summed-area table. Outside the grid nothing may be passed.
class SafeSpace {
 public:
  /// The free voxels of `passable` may be passed. O(voxels).
  explicit SafeSpace(map::OccupancyGrid passable) : passable_(std::move(passable)), sums_(passable_) {}

  const map::OccupancyGrid& grid() const noexcept { return passable_; }
  bool passable(const Index3& v) const noexcept { return passable_.free(v); }
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

 private:
  map::OccupancyGrid passable_;
  map::OccupancySums sums_;
};

}  // namespace backwash::plan
