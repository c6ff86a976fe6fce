// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "core/map/lattice.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/map/occupancy_sums.hpp"
#include "core/plan/search/components.hpp"
#include "core/plan/search/motion_primitive.hpp"

namespace backwash::plan {

/// The voxels that may be passed, with O(1) box queries by a summed-area table and the regions they form. Outside the
/// grid nothing may be passed. What a single search adds is a SafeView. Copies share what is equal in them.
class SafeSpace {
 public:
  /// The free voxels of `passable` may be passed. O(voxels).
  explicit SafeSpace(const map::OccupancyGrid& passable);
  /// Takes over what changed in `passable` within a box inside it (all else as before).
  void update(const map::OccupancyGrid& passable, const map::VoxelBox& changed);

  double resolution() const noexcept { return resolution_; }
  const Vec3& origin() const noexcept { return origin_W_; }
  const Index3& size() const noexcept { return size_; }
  /// Voxel that contains p; may lie outside.
  Index3 index(const Vec3& p_W) const noexcept { return ((p_W - origin_W_) / resolution_).array().floor().cast<int>(); }
  Vec3 center(const Index3& v) const noexcept {
    return origin_W_ + resolution_ * (v.cast<double>() + Vec3::Constant(0.5));
  }
  bool inside(const Index3& v) const noexcept { return map::inside(size_, v); }
  /// Precondition: inside(v).
  std::size_t linear(const Index3& v) const noexcept { return map::linear(size_, v); }
  bool passable(const Index3& v) const noexcept { return inside(v) && components_.free(v); }
  /// Whether all voxels with low ≤ v ≤ high may be passed; true for none. O(1).
  bool passable(const Index3& low, const Index3& high) const noexcept { return sums_.voxels_free(low, high); }
  /// The region of a voxel: passable voxels that share faces have the same one, those of two numbers are not joined
  /// (Components). 0: may not be passed. A motion whose closed swept set is passable never leaves its region.
  std::uint32_t region(const Index3& v) const noexcept { return inside(v) ? components_.of(v) : Components::kNone; }

 private:
  Vec3 origin_W_;
  double resolution_;
  Index3 size_;
  map::OccupancySums sums_;
  Components components_;
};

/// Number of moves to a goal from the voxels that a flood reached.
struct Hops {
  static constexpr std::uint32_t kUnreached = 0xffffffffu;
  std::vector<std::uint32_t> of_voxel;  ///< linear order
  std::uint32_t beyond;                 ///< at least this many where unreached; kUnreached: there is no way
  std::uint32_t at(std::size_t voxel) const noexcept {
    return of_voxel[voxel] == kUnreached ? beyond : of_voxel[voxel];
  }
};

/// A safe space for one search: a start and a goal that were found clear at their exact points count as passable voxels
/// whatever their centres say. The space must outlive it.
class SafeView {
 public:
  SafeView(const SafeSpace& space, const std::vector<Index3>& also = {});  // NOLINT: a space is a view without extras

  const SafeSpace& space() const noexcept { return *space_; }
  bool passable(const Index3& v) const noexcept;
  /// Whether every voxel that meets the closed box may be passed.
  bool clear(const Box& box) const noexcept;
  /// Whether every voxel with low ≤ v ≤ high may be passed; true for none.
  bool clear(const Index3& low, const Index3& high) const noexcept;
  /// Whether every voxel the motion meets may be passed: pieces with exact bounds, halved until their box is clear or
  /// smaller than a quarter of a voxel. Never true for a motion that touches a voxel that may not be passed.
  bool clear(const Motion& motion) const noexcept;
  /// False only if no motion that clear() accepts can join the two voxels. O(1).
  bool may_join(const Index3& a, const Index3& b) const noexcept;

  /// Number of king's moves (26 neighbours) through passable voxels from each voxel to `goal`. Any motion through
  /// passable voxels whose fastest axis covers S metres in total makes fewer than S/resolution + 1 of them: |Δp| ≤ a on
  /// each axis changes each index by at most 1. The flood ends a quarter beyond `enough`'s number of moves.
  Hops hops_to(const Index3& goal, const Index3& enough) const;
  /// Shortest way over shared faces, both ends included; empty if there is none. Breadth first.
  std::vector<Index3> chain(const Index3& from, const Index3& to) const;

 private:
  const SafeSpace* space_;
  std::vector<Index3> also_;  // not passable in the space itself, distinct
};

}  // namespace backwash::plan
