// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/field/disturbance_field.hpp"
#include "core/field/extension.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/map/voxel_box.hpp"
#include "core/reach/bound_code.hpp"
#include "core/types/disturbance.hpp"

namespace backwash::reach {

/// w̄ at every voxel of a stored field, for maxima over sets (docs/model.md section 3, "Over the set, not at its
/// centre"), and the mean push that an extended model has there: the disturbance at p is push(p, v) ± w̄. Keeps the
/// maxima over all cubes of 1, 2 and 4 voxels whose lowest voxel is v, for the v where one is not zero: 32 bytes per
/// entry, 1.03 bytes per voxel of the grid. They are kept in 16 bits and rounded up (bound_code.hpp): what is read is
/// w̄ to w̄·(1 + kBoundGrowth).
class BoundField {
 public:
  /// Unstored voxels count as 0 (the vehicle's centre cannot be there).
  /// `extension`: filled where the field is. What it does not know of the push is in w̄; its factor of Σ by place is
  /// expected in `field`.
  BoundField(const map::OccupancyGrid& grid, const field::DisturbanceField& field, const BoundModel& model,
             field::Extension extension = {});
  /// The same as BoundField(grid, field, …) from `old`, whose field differed at the voxels of `changed` alone.
  /// Precondition: of a model whose extension is not by place. O(voxels of the grid) to copy, the rest O(changed).
  BoundField(const BoundField& old, const field::DisturbanceField& field, const map::VoxelBox& changed);
  const field::Extension& extension() const noexcept { return extension_; }
  /// Mean push on a vehicle that moves with v at p, m/s². Real-time: wait-free, no allocation.
  Vec3 push(const Vec3& p_W, const Vec3& v_W) const noexcept { return extension_.push(p_W, v_W); }
  /// Largest deviation from `push_W` in each direction over the closed box, of a vehicle that moves with v: max_over
  /// without an extension. Larger boxes of voxels than kFew are bounded by the whole field's spread of pushes.
  /// Real-time: wait-free, no allocation.
  DisturbanceBound max_about(const Vec3& push_W, const Vec3& v_W, const Vec3& low_W, const Vec3& high_W) const noexcept;
  /// Of that, what the push alone deviates by, m/s².
  PerDirection push_spread(const Vec3& push_W, const Vec3& v_W, const Vec3& low_W, const Vec3& high_W) const noexcept;
  /// max_about over the voxels from low to high.
  DisturbanceBound max_about_voxels(const Vec3& push_W, const Vec3& v_W, const Index3& low,
                                    const Index3& high) const noexcept;
  /// Component-wise maximum of w̄ over the voxels, closed cubes, that meet the closed box [low, high], m in W; 0 if none
  /// does. Exact but for the rounding up. 1 look-up for boxes over 1, 2 or 4 voxels per axis, 8 up to 8 per axis, then
  /// O(voxels/64). Real-time: wait-free, no allocation.
  DisturbanceBound max_over(const Vec3& low_W, const Vec3& high_W) const noexcept;
  /// The same over the voxels from low to high, both included; what lies outside the grid counts as 0.
  DisturbanceBound max_over_voxels(Index3 low, Index3 high) const noexcept;
  /// w̄ at a voxel's centre, m/s²; 0 outside the grid.
  DisturbanceBound at(const Index3& v) const noexcept;

 private:
  static constexpr int kFew = 512;                              // voxels
  static constexpr int kLevels = 3;                             // cubes of 1 << level voxels
  static constexpr std::size_t kLargest = 1u << (kLevels - 1);  // edge of the largest, voxels
  static constexpr std::size_t kRun = 128;                      // voxels whose entries are numbered from one base
  using Maximum = std::array<BoundCode, kDirections>;
  struct alignas(32) Entry {
    std::array<Maximum, kLevels> level{};
  };
  bool inside(const Index3& v) const noexcept;
  map::VoxelBox meeting(const Vec3& low_W, const Vec3& high_W) const noexcept;
  DisturbanceBound moving(DisturbanceBound w, const Vec3& v_W) const noexcept;
  static DisturbanceBound decoded(const Maximum& codes) noexcept;
  std::size_t entry_of(std::size_t n) const noexcept;  // of a voxel in entries_; 0: every cube at it is zero
  void number_entries(const std::vector<std::uint8_t>& entered);
  void copy_entries(const BoundField& old) noexcept;
  void pool(int level, const map::VoxelBox& box) noexcept;

  Vec3 origin_W_;
  double resolution_;
  Index3 size_;
  std::vector<std::uint8_t> rank_;     // per voxel: its entry's number within the run, from 1; 0: none
  std::vector<std::uint32_t> before_;  // per run: entries of the runs before it
  std::vector<Entry> entries_;
  field::Extension extension_;
  BoundModel model_;
  Vec3 least_push_ = Vec3::Zero(), largest_push_ = Vec3::Zero();  // of the stored voxels
};

}  // namespace backwash::reach
