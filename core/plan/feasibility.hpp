// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "core/plan/world/world.hpp"

namespace backwash::plan {

/// A set of hover-safe voxels joined through faces: from each of them a vehicle can, slowly, reach each other.
struct Region {
  std::size_t voxels = 0;
  double volume_m3 = 0;
  Vec3 low_W, high_W;         ///< extent, outer faces of its voxels, m
  Vec3 widest_W;              ///< centre of its voxel with the largest clearance
  double widest_clearance_m;  ///< clearance of the hover set there
};

struct Regions {
  using Number = std::optional<std::uint32_t>;
  std::vector<Region> regions;   ///< by falling volume; ties by first voxel
  std::vector<Number> of_voxel;  ///< in which of them each voxel is; in none where hovering is not safe
};

/// Connected components (6 neighbours) of the voxels where hovering is safe. O(cells).
Regions hover_regions(const World& world);

/// The tightest place of the widest way between two points.
struct Bottleneck {
  bool passable;           ///< every voxel of the way is hover-safe
  Vec3 place_W;            ///< where it is tightest, m
  double clearance_m;      ///< of the hover set there; negative: by how much it does not fit, where that is known
  double free_distance_m;  ///< centre to the nearest obstacle there
  double length_m;         ///< of the way, voxel to voxel
};

/// Maximin search (Dijkstra) over free voxels with 6 neighbours: the way whose tightest voxel is as wide as possible,
/// hover-safe voxels before all others. Width is the clearance of the hover set, and the distance to obstacles where
/// the set does not fit. Nothing if the points are not joined by free voxels. O(cells log cells).
std::optional<Bottleneck> widest_way(const World& world, const Vec3& from_W, const Vec3& to_W);

/// What taking Σ over the set instead of at its centre costs (docs/model.md section 3).
struct SetCost {
  std::size_t safe_at_centre = 0;         ///< voxels that would be hover-safe with Σ of their centre
  std::size_t lost = 0;                   ///< of these, not hover-safe with Σ over the set
  double median_m = 0, quantile95_m = 0;  ///< clearance given up at the others with less than the cap, m
};
/// Precondition: method tight, no constant margin. Clearances are looked for where bounds on them leave the quantiles
/// open. O(voxels · prism_distance): offline.
SetCost cost_of_set(const World& world, const Parallel& parallel = run_serial);

/// The hover set against a ball of constant radius in its place, over the free voxels where body and estimation fit
/// (distance > body.radius + estimation.position): where one holds the other, hovering safely with the larger implies
/// it with the smaller, whatever stands around.
struct AgainstMargin {
  double margin_m;
  std::size_t voxels = 0;           ///< of these,
  std::size_t ball_inside_set = 0;  ///< voxels where every face of the set is at least the margin away
  std::size_t set_inside_ball = 0;  ///< voxels where no corner is farther away than it
  std::size_t unbounded = 0;        ///< voxels where the set leaves the clear space: in neither count
  std::size_t only_ball_safe = 0;   ///< voxels where hovering is safe with the ball and not with the set
  std::size_t only_set_safe = 0;    ///< and the other way round
};
/// One entry a margin. Precondition: no constant margin in the world. O(voxels · prism_distance): offline.
std::vector<AgainstMargin> set_against_margins(const World& world, const std::vector<double>& margins_m,
                                               const Parallel& parallel = run_serial);

/// Two hover points far apart in the largest region, one a column where its clearance is largest; the first one passes
/// `can_take_off`. Deterministic for a world.
struct HoverPair {
  Vec3 start_W, goal_W;
};
std::optional<HoverPair> farthest_pair(const World& world, const Regions& regions,
                                       const std::function<bool(const Vec3&)>& can_take_off);

}  // namespace backwash::plan
