// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>

#include "core/map/distance_field.hpp"
#include "core/map/occupancy_sums.hpp"
#include "core/map/voxel_box.hpp"
#include "core/reach/bound/bound_field.hpp"
#include "core/reach/reach_tube.hpp"

namespace backwash::reach {

/// The infinite-time set of a vehicle hovering at a point (docs/model.md sections 3 and 5).
struct HoverSet {
  PerDirection half_widths{};  ///< m
  Vec3 shift = Vec3::Zero();   ///< of its centre from the set-point, m: mean push of an extended model over k_p
  double clearance = 0;  ///< distance of the set to obstacles − body.radius − estimation.position, m, capped at 1 m
  bool bounded = false;  ///< false: the fixed point left the clear space before it converged
  bool safe() const noexcept { return bounded && clearance > 0; }
};

/// Smallest fixed point of h = h_∞ × max w̄(c ± h), then its clearance; c = p + d(p)/k_p with d the mean push at p, and
/// by how much the push differs over the set is in w̄. For method paper h is the support of the
/// infinite-time ellipsoid instead. Unbounded, with the clearance of touching, when h exceeds the free distance and
/// where p or c is not in a free voxel. A `constant_margin`, m, replaces the set by a ball of that radius (the baseline
/// of `--margin`). Cost: some look-ups of max_over and one prism_distance, which the distance field limits, and the
/// `sums` of `grid` where they are given.
HoverSet hover_set(const Reachability& reach, const map::OccupancyGrid& grid, const map::DistanceField& distance,
                   const BoundField& bounds, const Vec3& p_W, std::optional<double> constant_margin = std::nullopt,
                   const map::OccupancySums* sums = nullptr);

/// The same set without its clearance, which is the dear part: `clearance` is that of touching. `arrival`: the set
/// holds for ever after this tube, whose commands come to rest at p (rest.hpp); null: the vehicle has always hovered
/// there.
HoverSet hover_extent(const Reachability& reach, const map::OccupancyGrid& grid, const map::DistanceField& distance,
                      const BoundField& bounds, const Vec3& p_W, std::optional<double> constant_margin = std::nullopt,
                      const ReachTube* arrival = nullptr);

/// Whether hovering at each voxel's centre is safe: hover_set(…).safe(), without the sets' clearances (hover_set gives
/// them where they are asked for). For method paper the sets come from a table that is rounded up by up to 3e-5.
class HoverMap {
 public:
  /// Nothing is safe yet.
  explicit HoverMap(const map::OccupancyGrid& grid);
  /// Computes the listed voxels (linear indices); distinct voxels may be computed from several threads at once.
  /// `distance` and `sums` are those of `grid`.
  void fill(const Reachability& reach, const map::OccupancyGrid& grid, const map::DistanceField& distance,
            const map::OccupancySums& sums, const BoundField& bounds, std::span<const std::size_t> voxels,
            std::optional<double> constant_margin = std::nullopt);
  /// The voxel is safe, as fill() found it before. Precondition: inside the grid.
  void set_safe(const Index3& v) noexcept { safe_.set(v, map::Cell::free); }
  /// As if the voxels of a box inside the grid had never been computed.
  void clear(const map::VoxelBox& box) noexcept;
  /// False outside the grid and where nothing was computed.
  bool safe(const Index3& v) const noexcept { return safe_.free(v); }
  /// The same voxels with the safe ones free and all others unknown.
  const map::OccupancyGrid& safe_voxels() const noexcept { return safe_; }

 private:
  map::OccupancyGrid safe_;
};

}  // namespace backwash::reach
