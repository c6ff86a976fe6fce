// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/field/disturbance_field.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/types/disturbance.hpp"

namespace backwash::reach {

/// w̄ at every voxel of a stored field, for maxima over sets (model.md section 3, "Over the set, not at its centre").
/// Keeps the maxima over all cubes of 1, 2 and 4 voxels whose lowest voxel is v, for the v where one is not zero:
/// 64 bytes per entry, 4 bytes per voxel of the grid.
class BoundField {
 public:
  /// Unstored voxels count as 0 (the vehicle's centre cannot be there).
  BoundField(const map::OccupancyGrid& grid, const field::DisturbanceField& field, const BoundModel& model);
  /// Component-wise maximum of w̄ over the voxels, closed cubes, that meet the closed box [low, high], m in W; 0 if none
  /// does. Exact. 1 look-up for boxes over 1, 2 or 4 voxels per axis, 8 up to 8 per axis, then O(voxels/64).
  /// Real-time: wait-free, no allocation.
  DisturbanceBound max_over(const Vec3& low_W, const Vec3& high_W) const noexcept;
  /// The same over the voxels from low to high, both included; what lies outside the grid counts as 0.
  DisturbanceBound max_over_voxels(Index3 low, Index3 high) const noexcept;
  /// w̄ at a voxel's centre, m/s²; 0 outside the grid.
  DisturbanceBound at(const Index3& v) const noexcept;

 private:
  static constexpr int kLevels = 3;  // cubes of 1 << level voxels
  using Maximum = std::array<float, kDirections>;
  struct alignas(64) Entry {
    std::array<Maximum, kLevels> level{};
  };
  bool inside(const Index3& v) const noexcept;
  const Entry& entry(const Index3& v) const noexcept;
  void number_entries(std::vector<std::uint8_t> stored);
  void pool(int level) noexcept;

  Vec3 origin_W_;
  double resolution_;
  Index3 size_;
  std::vector<std::uint32_t> entry_of_;  // per voxel; 0: every cube at v is zero
  std::vector<Entry> entries_;
};

}  // namespace backwash::reach
