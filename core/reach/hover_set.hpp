// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "core/map/distance_field.hpp"
#include "core/map/scan.hpp"
#include "core/reach/bound_field.hpp"
#include "core/reach/reach_tube.hpp"

namespace backwash::reach {

/// The infinite-time set of a vehicle hovering at a point (model.md sections 3 and 5).
struct HoverSet {
  PerDirection half_widths{};  ///< m
  double clearance = 0;  ///< distance of the set to obstacles − body.radius − estimation.position, m, capped at 1 m
  bool bounded = false;  ///< false: the fixed point left the clear space before it converged
  bool safe() const noexcept { return bounded && clearance > 0; }
};

/// Smallest fixed point of h = h_∞ × max w̄(p ± h), then its clearance. For method paper h is the support of the
/// infinite-time ellipsoid instead. Unbounded, with the clearance of touching, when h exceeds the free distance and
/// where p is not in a free voxel. `constant_margin` >= 0 replaces the set by a ball of that radius (the baseline of
/// `--margin`). Cost: some look-ups of max_over and one prism_distance, which the distance field limits.
HoverSet hover_set(const Reachability& reach, const map::OccupancyGrid& grid, const map::DistanceField& distance,
                   const BoundField& bounds, const Vec3& p_W, double constant_margin = -1);

/// Whether hovering at each voxel's centre is safe, and how wide the set is.
class HoverMap {
 public:
  explicit HoverMap(const map::OccupancyGrid& grid);
  /// Computes the listed voxels (linear indices); distinct voxels may be computed from several threads at once.
  void fill(const Reachability& reach, const map::OccupancyGrid& grid, const map::DistanceField& distance,
            const BoundField& bounds, std::span<const std::size_t> voxels, double constant_margin = -1);
  /// As if the voxels of a box inside the grid had never been computed.
  void clear(const map::VoxelBox& box) noexcept;
  /// False outside the grid and where nothing was computed.
  bool safe(const Index3& v) const noexcept;
  /// Clearance of the hover set where safe, m; elsewhere ≤ 0 and no less than it, −1 where not computed and outside the
  /// grid. What no set needs is not computed: where the body alone does not fit, or a tip of the set is too near.
  double clearance(const Index3& v) const noexcept;
  /// Half widths x, y, z, m; zero where not computed, unbounded, or too near for the body alone.
  Vec3 half_widths(const Index3& v) const noexcept;

 private:
  static constexpr std::array<float, 4> kNotComputed{-1, 0, 0, 0};
  bool inside(const Index3& v) const noexcept;
  std::size_t linear(const Index3& v) const noexcept;
  const std::array<float, 4>& cell(const Index3& v) const noexcept;

  Index3 size_;
  std::vector<std::array<float, 4>> cells_;  // clearance, half widths x, y, z
};

}  // namespace backwash::reach
