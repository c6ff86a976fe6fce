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

/// Two hover points far apart in the largest region, one a column where its clearance is largest; the first one passes
/// `can_take_off`. Deterministic for a world.
struct HoverPair {
  Vec3 start_W, goal_W;
};
std::optional<HoverPair> farthest_pair(const World& world, const Regions& regions,
                                       const std::function<bool(const Vec3&)>& can_take_off);

}  // namespace backwash::plan
