// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>

#include "core/map/distance_field.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/map/occupancy_sums.hpp"
#include "core/reach/reach_tube.hpp"
#include "core/types/geometry.hpp"

namespace backwash::reach {

/// The largest distance of a point of the prism from its centre, m.
double circumradius(const PerDirection& half_widths) noexcept;

/// Clearances of hover sets are exact up to this, m; larger ones are told as this.
inline constexpr double kHoverClearanceCap = 1.0;

/// Of a set's distance to obstacles, what body and estimate take before clearance begins, m.
double body_and_estimation(const Vehicle& vehicle) noexcept;

/// Distance from an octagonal prism to the nearest face of an occupied or unknown voxel, m, 0 if they meet
/// (docs/model.md section 4, "Clearance", before body and estimation are taken off). The prism is
/// {center + e : |unit(d)·e| ≤ half_widths[d] for every Direction d}; outside the grid is unknown.
/// Exact up to `limit`; returns `limit` if nothing is nearer. O((extent/a)³); the same, sooner, with the `sums` of
/// `grid`, by which layers without obstacles are skipped.
double prism_distance(const map::OccupancyGrid& grid, const Vec3& center_W, const PerDirection& half_widths,
                      double limit, const map::OccupancySums* sums = nullptr);

/// Whether nothing comes as near to the prism as `least`, m: prism_distance > least. Ends at the first voxel that
/// is too near.
bool prism_clear(const map::OccupancyGrid& grid, const map::OccupancySums& sums, const Vec3& center_W,
                 const PerDirection& half_widths, double least);

/// Distance of a prism that moves from one centre to another: the convex hull of both, enclosed by the prism at their
/// midpoint whose half widths grow by half the motion in each direction.
double swept_prism_distance(const map::OccupancyGrid& grid, const Vec3& from_W, const Vec3& to_W,
                            const PerDirection& half_widths, double limit);

/// An axis-aligned cube, m in W: a voxel, or some in one; with `more` a box, longer than a cube by that along x, y, z.
struct Cube {
  Vec3 center = Vec3::Zero();
  double edge = 0;
  Vec3 more = Vec3::Zero();
};

/// First entry of a tube from `from` on whose set, swept until the next entry as in swept_prism_distance, comes within
/// `taken` (body.radius + estimation.position, m) of the cube, or touches it at that distance; the tube's size if none
/// does. After the last entry it holds. `from` past the end means the last entry. The same measure as a tube's
/// verification: what a verified tube was held against never blocks it. Real-time: wait-free, no allocation;
/// O(entries), 3 to 5 ns for each that is far from the cube.
std::size_t first_blocked(std::span<const TubeStep> tube, std::size_t from, const Cube& cube, double taken) noexcept;

}  // namespace backwash::reach
