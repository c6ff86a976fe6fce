// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/reach/bound/bound_field.hpp"
#include "core/reach/reach_tube.hpp"

namespace backwash::reach {

/// How far hover sets around the centres of voxels reach at most along x, y and z, by blocks of 4³ voxels: what is
/// clear with that is clear with a voxel's own set, without its iteration. For method tight, no extension and no
/// integrator.
class BlockExtents {
 public:
  /// The bounds, of a grid of that size and resolution, must outlive it.
  BlockExtents(const Reachability& reach, const BoundField& bounds, const Index3& size, double resolution);

  /// m, of the block that holds a voxel of the grid. At least the smallest fixed point of hover_set(), if there is one;
  /// where sets may be wider than kMost voxels, that of the whole field. Not for two threads at once.
  const Vec3& at(const Index3& v);

 private:
  static constexpr int kShift = 2, kEdge = 1 << kShift;
  static constexpr double kMost = 16;
  /// Of each block of a grid, found when they are first asked for. Rows along x; one that nobody asked for is empty.
  struct Blocks {
    Index3 count;
    std::vector<std::vector<Vec3>> rows;
    template <class Find>
    const Vec3& at(const Index3& b, const Find& find);
  };
  Vec3 half_widths(const DisturbanceBound& w_bar) const noexcept;
  const Vec3& own(const Index3& block);
  Vec3 found(const Index3& block);

  const BoundField& bounds_;
  double horizontal_, vertical_, per_voxel_;
  Vec3 most_;  // of the whole field
  Blocks extents_, own_;
};

}  // namespace backwash::reach
