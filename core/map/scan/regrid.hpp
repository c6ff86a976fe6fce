// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <utility>

#include "core/map/occupancy_grid.hpp"

namespace backwash::map {

/// Where a file's content goes: p_W = rotation · (scale · p) − origin.
struct Placement {
  double scale = 1;             ///< m per unit of the file, > 0
  Mat3 R_W = Mat3::Identity();  ///< file to W, a rotation
  Vec3 origin = Vec3::Zero();   ///< what becomes the world's origin, after scale and rotation, m

  Vec3 operator()(const Vec3& p) const noexcept { return R_W * (scale * p) - origin; }
  Vec3 back(const Vec3& p_W) const noexcept { return R_W.transpose() * (p_W + origin) / scale; }
};

/// Corners (m, W) of the box around a box (low, high) that is placed.
std::pair<Vec3, Vec3> placed_box(const Placement& place, const Vec3& low, const Vec3& high) noexcept;

/// Fills the grid `target`, all of it, from another one that is placed. A voxel is occupied if one of the source's
/// voxels under it is, else unknown if one of those is, else free; under it are those that meet the box around the
/// voxel in the source's frame by more than kOnFace of their edge. So nothing is called free that was not, at any
/// resolution; a rotation about a slant thickens what is occupied by up to 0.73 voxels. O(cells · (ratio of edges)³).
void regrid(const OccupancyGrid& source, const Placement& place, OccupancyGrid& target);

}  // namespace backwash::map
